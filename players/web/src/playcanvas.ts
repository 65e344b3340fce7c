/**
 * Avatars in PlayCanvas, on WebGL2 and WebGPU. playcanvas is a peer dependency; release 2.23 was tried.
 *
 * Avatars are drawn after the transparent meshes of a layer. They are hidden by what meshes wrote to the depth buffer.
 * They write depth where `depthAlpha` is given. They take the lights of the layer where they were packed with
 * `--relight`, and cast shadows where `shadows` is asked for. Tone mapping in materials does not change them; that of a
 * CameraFrame does.
 */
export { AvatarNode, AvatarScene, type AvatarSceneOptions } from "./playcanvas/scene.js";
