// The package stays small: node --test tests/size.test.mjs.
import assert from "node:assert/strict";
import { test } from "node:test";
import { LIMIT, sizes } from "../bench/size.mjs";

test("script and shaders, gzipped", async (t) => {
  const { script, kernels } = await sizes();
  t.diagnostic(`script with its shaders ${script} bytes, kernels ${kernels} bytes`);
  assert.ok(script <= LIMIT, `${script} bytes`);
  assert.ok(script > LIMIT / 4, "shaders are in it");
});
