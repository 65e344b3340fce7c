// Reads splats with three.js, a .glb or a .ply: the numbers of the file as its loaders decode them ("raw/..."), and
// what its splat loaders make of them ("position", "covariance", "color", "sphericalHarmonics1"...).
import { GaussianSplatPLYLoader } from "three/addons/loaders/GaussianSplatPLYLoader.js";
import { GLTFGaussianSplatLoaderExtension } from "three/addons/loaders/GLTFGaussianSplatLoaderExtension.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import { REVISION } from "three";
import { answer, job, readBytes } from "./job.mjs";

globalThis.self ??= globalThis;

async function glb(data) {
  const loader = new GLTFLoader().register((parser) => new GLTFGaussianSplatLoaderExtension(parser));
  const { parser, scene } = await loader.parseAsync(data.buffer, "");
  let splats;
  scene.traverse((object) => {
    if (object.isGaussianSplat) splats = object;
  });
  const [raw] = await parser.loadGeometries(parser.json.meshes[0].primitives);
  return [raw, splats.splatGeometry, splats.userData.gltfExtensions];
}

function ply(data) {
  const numbers = (prefix, count) => Array.from({ length: count }, (_, k) => `${prefix}_${k}`);
  const header = new TextDecoder().decode(data.subarray(0, 4096));
  const rest = header.match(/ f_rest_\d+/g)?.length ?? 0;
  const loader = new PLYLoader();
  loader.setCustomPropertyNameMapping({
    scale: numbers("scale", 3),
    rot: numbers("rot", 4),
    f_dc: numbers("f_dc", 3),
    opacity: ["opacity"],
    ...(rest ? { f_rest: numbers("f_rest", rest) } : {}),
  });
  return [loader.parse(data.buffer), new GaussianSplatPLYLoader().parse(data.buffer), {}];
}

const read = job.file.endsWith(".glb") ? glb : ply;
const [raw, geometry, extensions] = await read(readBytes(job.file));
const arrays = {};
for (const [name, attribute] of Object.entries(raw.attributes)) arrays[`raw/${name}`] = attribute.array;
for (const [name, attribute] of Object.entries(geometry.attributes)) arrays[name] = attribute.array;
answer({ version: REVISION, splats: geometry.attributes.position.count, extensions }, arrays);
