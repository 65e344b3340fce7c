// Reads splats.glb with Babylon.js: the rows that its KHR_gaussian_splatting loader hands to the splat mesh, before
// they go to textures. A row has position and scale as floats, colour, opacity and quaternion (w, x, y, z) as bytes.
import { answer, job, readBytes } from "./job.mjs"; // first: it takes standard output
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { GaussianSplattingMesh } from "@babylonjs/core/Meshes/GaussianSplatting/gaussianSplattingMesh.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/glTFLoader.js";
import "@babylonjs/loaders/glTF/2.0/Extensions/KHR_gaussian_splatting.js";

const arrays = {};
GaussianSplattingMesh.prototype.updateDataAsync = async function (rows, harmonics) {
  arrays.rows = new Uint8Array(rows);
  (harmonics ?? []).forEach((bytes, k) => (arrays[`harmonics/${k}`] = Uint8Array.from(bytes)));
};

const scene = new Scene(new NullEngine());
scene.useRightHandedSystem = true;
const url = `data:model/gltf-binary;base64,${Buffer.from(readBytes(job.file)).toString("base64")}`;
const loaded = await LoadAssetContainerAsync(url, scene, { pluginExtension: ".glb" });
const mesh = loaded.meshes.find((node) => node instanceof GaussianSplattingMesh);
answer({ version: NullEngine.Version, world: Array.from(mesh.computeWorldMatrix(true).asArray()) }, arrays);
