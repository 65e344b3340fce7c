// The package stays small: node --test tests/size.test.mjs.
import assert from "node:assert/strict";
import { test } from "node:test";
import { LIMIT, sizes } from "../bench/size.mjs";

test("the tag with one backend, gzipped", async (t) => {
  const { tag, webgpu, webgl2, kernels } = await sizes();
  t.diagnostic(`tag ${tag}, WebGPU ${webgpu}, WebGL2 ${webgl2}, WebAssembly ${kernels} bytes`);
  for (const [name, bytes] of Object.entries({ webgpu, webgl2 })) {
    assert.ok(bytes > 8000, `${name} is in it`);
    assert.ok(tag + bytes <= LIMIT, `${name}: ${tag + bytes} bytes`);
  }
});
