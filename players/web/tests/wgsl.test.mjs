// Chromium's WebGPU takes every WGSL module, with exactly the bindings that INTERFACES names. `node --test` runs it.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { build } from "esbuild";
import { launch } from "./browser.mjs";

const CONTENTS = 'export { WGSL } from "./wgsl.ts"; export { GLSL } from "./glsl.ts"; export { INTERFACES } from "./reflection.ts";';

let browser, page, server;

before(async () => {
  const resolveDir = new URL("../src/made", import.meta.url).pathname;
  const bundle = await build({ stdin: { contents: CONTENTS, resolveDir }, bundle: true, write: false, format: "iife", globalName: "made" });
  server = createServer((_, response) => response.setHeader("content-type", "text/html").end("<!doctype html>"));
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready)); // WebGPU wants a secure context
  browser = await launch();
  page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.addScriptTag({ content: `${bundle.outputFiles[0].text};window.made = made;` });
});

after(async () => {
  await browser?.close();
  server?.close();
});

test("WebGPU compiles every entry and binds what INTERFACES names", async () => {
  const { names, faults } = await page.evaluate(async () => {
    const { WGSL, INTERFACES } = window.made;
    const faults = [];
    const device = await (await navigator.gpu.requestAdapter()).requestDevice();
    const visibility = { compute: 4, vertex: 1, fragment: 2 };
    const layouts = {}, modules = {};
    for (const [name, told] of Object.entries(INTERFACES)) {
      modules[name] = device.createShaderModule({ code: WGSL[name] });
      const { messages } = await modules[name].getCompilationInfo();
      faults.push(...messages.map((message) => `${name}: ${message.type}: ${message.message}`));
      const seen = visibility[told.kind];
      const entries = told.storage.map((buffer) => ({
        binding: buffer.binding,
        visibility: seen,
        buffer: { type: buffer.readonly ? "read-only-storage" : "storage", minBindingSize: buffer.stride },
      }));
      if (told.uniforms) {
        const buffer = { type: "uniform", minBindingSize: told.uniforms.size };
        entries.push({ binding: told.uniforms.binding, visibility: seen, buffer });
      }
      for (const { binding } of told.textures) {
        entries.push({ binding, visibility: seen, texture: { sampleType: "unfilterable-float" } });
      }
      layouts[name] = entries;
    }
    const layout = (entries) => {
      const bindGroupLayouts = [device.createBindGroupLayout({ entries })];
      return device.createPipelineLayout({ bindGroupLayouts });
    };
    const attempt = async (name, make) => make().catch((error) => faults.push(`${name}: ${error.message}`));
    for (const [name, told] of Object.entries(INTERFACES)) {
      if (told.kind !== "compute") continue;
      const compute = { module: modules[name], entryPoint: name };
      await attempt(name, () => device.createComputePipelineAsync({ layout: layout(layouts[name]), compute }));
    }
    const attributes = INTERFACES.raster_vertex.inputs.map(({ location, type }) => {
      return { shaderLocation: location, format: type.replace("float", "float32x"), offset: 16 * location };
    });
    const buffers = { raster: [{ arrayStride: 16 * attributes.length, stepMode: "instance", attributes }], composite: [] };
    for (const [draw, vertexBuffers] of Object.entries(buffers)) {
      const [vertex, pixel] = [`${draw}_vertex`, `${draw}_pixel`];
      const described = {
        layout: layout([...layouts[vertex], ...layouts[pixel]]),
        vertex: { module: modules[vertex], entryPoint: vertex, buffers: vertexBuffers },
        fragment: { module: modules[pixel], entryPoint: pixel, targets: [{ format: "rgba16float" }] },
        primitive: { topology: "triangle-strip" },
      };
      await attempt(draw, () => device.createRenderPipelineAsync(described));
    }
    device.destroy();
    return { names: Object.keys(WGSL), faults };
  });
  assert.deepEqual(faults, []);
  assert.equal(names.length, 18);
});

test("WebGPU says what is wrong with a module", async () => {
  const faults = await page.evaluate(async () => {
    const device = await (await navigator.gpu.requestAdapter()).requestDevice();
    device.pushErrorScope("validation");
    const code = `${window.made.WGSL.activate} fn more() { nowhere(); }`;
    const { messages } = await device.createShaderModule({ code }).getCompilationInfo();
    await device.popErrorScope();
    return messages.map((message) => message.type);
  });
  assert.ok(faults.includes("error"));
});

test("WebGL2 links what draws, with the textures and blocks that INTERFACES names", async () => {
  const faults = await page.evaluate(() => {
    const { GLSL, INTERFACES } = window.made;
    const gl = new OffscreenCanvas(1, 1).getContext("webgl2");
    const faults = [];
    const draws = [
      { vertex: "raster_vertex_batch", pixel: "raster_pixel", uniforms: INTERFACES.raster_vertex.uniforms, textures: ["QuadTexels"] },
      { vertex: "composite_vertex", pixel: "composite_pixel", ...INTERFACES.composite_pixel, textures: ["Accumulated"] },
    ];
    for (const { vertex, pixel, uniforms, textures } of draws) {
      const program = gl.createProgram();
      for (const [name, kind] of [[vertex, gl.VERTEX_SHADER], [pixel, gl.FRAGMENT_SHADER]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, GLSL[name]);
        gl.compileShader(shader);
        faults.push(gl.getShaderInfoLog(shader));
        gl.attachShader(program, shader);
      }
      gl.linkProgram(program);
      faults.push(gl.getProgramInfoLog(program));
      for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_ATTRIBUTES); i++) {
        const { name } = gl.getActiveAttrib(program, i);
        if (!name.startsWith("gl_")) faults.push(`attribute ${name}`);
      }
      for (const name of textures) if (!gl.getUniformLocation(program, name)) faults.push(`texture ${name}`);
      const index = gl.getUniformBlockIndex(program, uniforms.name);
      if (index === gl.INVALID_INDEX) faults.push(`no block ${uniforms.name}`);
      const members = uniforms.members.map(({ name }) => `${uniforms.name}.${name}`);
      const offsets = gl.getActiveUniforms(program, gl.getUniformIndices(program, members), gl.UNIFORM_OFFSET);
      uniforms.members.forEach(({ name, offset }, i) => {
        if (offsets[i] !== offset) faults.push(`${name} at ${offsets[i]}`);
      });
    }
    return faults.filter((fault) => fault?.replace(/\0/g, "").trim());
  });
  assert.deepEqual(faults, []);
});
