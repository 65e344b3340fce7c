/**
 * Avatars in three.js, under WebGLRenderer and WebGPURenderer. three is a peer dependency; release 187 was tried.
 *
 * Avatars are drawn after the transparent meshes of their scene and are hidden by what its meshes wrote to the depth
 * buffer. They write depth where `depthAlpha` is given. They take the lights of the scene where they were packed with
 * `--relight`, and cast shadows where `shadows` is asked for. Tone mapping of the canvas does not change them;
 * post-processing does.
 */
export { AvatarObject, AvatarScene, type AvatarSceneEventMap } from "./three/scene.js";
export type { AvatarSceneOptions } from "./engine/host.js";
