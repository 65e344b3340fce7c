/**
 * Avatars in Babylon.js, on WebGL2 and WebGPU. @babylonjs/core is a peer dependency; release 9.34 was tried.
 *
 * Avatars are drawn after all meshes of their scene and before its post-processes. They are hidden by what meshes wrote
 * to the depth buffer. They write depth where `depthAlpha` is given. They take the lights of the scene where they were
 * packed with `--relight`, and cast shadows where `shadows` is asked for.
 */
export { AvatarNode, AvatarScene } from "./babylon/scene.js";
export type { AvatarSceneOptions } from "./engine/host.js";
