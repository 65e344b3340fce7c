// What the tests of the core look at: the public face, and parts that no user needs.
export * from "../../src/index.js";
export { depthAlphaOf } from "../../src/engine/host.js";
export { INTERFACES } from "../../src/made/reflection.js";
export { checkProgram } from "../../src/pack/check.js";
export { contentOf } from "../../src/pack/content.js";
export { SHADERS } from "../../src/pack/versions.js";
export { quatFromMatrix, setRotation } from "../../src/pose/affine.js";
export { Rigs } from "../../src/engine/rig_mesh.js";
export { Anchors } from "../../src/pose/anchors.js";
export { kernelModule } from "../../src/webgl2/kernel_module.js";
export { LocalPort } from "../../src/webgl2/local_port.js";
export { QuadSource } from "../../src/webgl2/quad_source.js";
export { KernelScene, kernelProgram } from "../../src/webgl2/kernel_scene.js";
