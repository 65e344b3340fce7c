// Changed programs: this checker accepts and refuses what Python's does, and names the same place.

import assert from "node:assert/strict";
import { test } from "node:test";
import { core, json } from "./harness.mjs";

const { sections, buffers, passes, programs } = json("programs.json");
const ELEMENTS = { 8: Uint8Array, 16: Uint16Array, 32: Uint32Array };
const LISTS = ["deform", "view", "shadow", "light"];
const NOT_FINITE = { NaN: NaN, Infinity: Infinity };

const SECTIONS = sections.map(([name, bits, base64]) => {
  const bytes = Uint8Array.from(Buffer.from(base64, "base64"));
  return { name, elements: new ELEMENTS[bits](bytes.buffer) };
});
const BUFFERS = buffers.map(([name, bytes, held]) => ({ name, bytes, sections: held.map((i) => SECTIONS[i]) }));
for (const one of passes) {
  for (const [name, value] of Object.entries(one.constants)) {
    one.constants[name] = NOT_FINITE[value] ?? value;
  }
}

function programOf(said) {
  return {
    ...said,
    buffers: new Map(said.buffers.map(([name, i]) => [name, BUFFERS[i]])),
    mesh: said.mesh.map((i) => passes[i]),
    levels: said.levels.map((level) => ({ ...level, ...Object.fromEntries(LISTS.map((list) => [list, level[list].map((i) => passes[i])])) })),
  };
}

function refusal(said) {
  try {
    core.checkProgram(programOf(said), said.groups, core.INTERFACES);
    return null;
  } catch (error) {
    assert.equal(error.name, "AvatarError", error.stack);
    assert.ok(!error.message.includes("\n") && error.message.length < 250, error.message);
    return error;
  }
}

test("planted faults are named as Python names them", () => {
  const planted = programs.filter((said) => said.message !== "");
  assert.ok(planted.length > 40);
  for (const said of planted) {
    const error = refusal(said);
    assert.ok(error, `${said.field}: ${said.message} was accepted`);
    assert.equal(error.field, said.field, said.message);
    const reason = error.reason.replace("is Infinity", "is inf").replace("is false", "is False");
    assert.ok(reason.includes(said.message), `${error.reason} | ${said.message}`);
  }
});

test("every other change has the same verdict as in Python", () => {
  const accepted = programs.filter((said) => said.field === null);
  assert.ok(accepted.length > 50 && programs.length > 800);
  const differ = programs
    .map((said) => [said.field, refusal(said)?.field ?? null])
    .filter(([want, got]) => want !== got);
  assert.deepEqual(differ, []);
});
