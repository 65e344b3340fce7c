// Poses a rigged .glb with Babylon.js and its NullEngine. Job and answer as in clients.py.
import { answer, indexOf, job, readBytes, takePoses } from "./job.mjs"; // first: it takes standard output
import { NullEngine } from "@babylonjs/core/Engines/nullEngine.js";
import { LoadAssetContainerAsync } from "@babylonjs/core/Loading/sceneLoader.js";
import { Quaternion, Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { Scene } from "@babylonjs/core/scene.js";
import "@babylonjs/loaders/glTF/2.0/glTFLoader.js";

const engine = new NullEngine();
const scene = new Scene(engine);
scene.useRightHandedSystem = true; // else a root node mirrors z
const url = `data:model/gltf-binary;base64,${Buffer.from(readBytes(job.glb)).toString("base64")}`;
const loaded = await LoadAssetContainerAsync(url, scene, { pluginExtension: ".glb" });
loaded.addAllToScene();
loaded.animationGroups.forEach((group) => group.stop());

const everything = [...loaded.meshes, ...loaded.transformNodes];
const nodes = new Map(everything.map((node) => [node.name, node]));
const mesh = loaded.meshes.find((node) => node.skeleton);
const morphs = mesh.morphTargetManager;
const targets = Array.from({ length: morphs?.numTargets ?? 0 }, (_, k) => morphs.getTarget(k));
const rest = everything.map((node) => [
  node,
  node.position.clone(),
  node.rotationQuaternion?.clone() ?? Quaternion.Identity(),
  node.scaling.clone(),
]);

function toRest() {
  for (const [node, position, rotation, scaling] of rest) {
    node.position = position.clone();
    node.rotationQuaternion = rotation.clone();
    node.scaling = scaling.clone();
  }
  targets.forEach((target) => (target.influence = 0));
}

function setPose(pose) {
  for (const [name, { translation, rotation_xyzw, scale }] of Object.entries(pose.nodes)) {
    const node = nodes.get(name);
    node.position = Vector3.FromArray(translation);
    node.rotationQuaternion = Quaternion.FromArray(rotation_xyzw);
    node.scaling = Vector3.FromArray(scale);
  }
  pose.weights.forEach((weight, k) => (targets[k].influence = weight));
}

function posed() {
  everything.forEach((node) => node.computeWorldMatrix(true));
  mesh.skeleton.prepare(true);
  const out = Float32Array.from(mesh.getPositionData(true, true));
  const vertex = new Vector3();
  for (let i = 0; i < out.length; i += 3) {
    Vector3.TransformCoordinatesFromFloatsToRef(out[i], out[i + 1], out[i + 2], mesh.getWorldMatrix(), vertex);
    vertex.toArray(out, i);
  }
  return out;
}

const arrays = { triangles: Uint32Array.from(mesh.getIndices()) };
for (const kind of mesh.getVerticesDataKinds()) {
  arrays[`attribute/${kind}`] = Float32Array.from(mesh.getVerticesData(kind));
}
takePoses(arrays, toRest, setPose, posed);
for (const { clip, times } of job.clips) {
  toRest();
  const group = loaded.animationGroups[indexOf(clip, loaded.animationGroups)];
  group.start(false);
  group.pause();
  const rate = group.targetedAnimations[0].animation.framePerSecond;
  times.forEach((time, k) => {
    group.goToFrame(time * rate);
    arrays[`clip/${clip}/${k}`] = posed();
  });
  group.stop();
}

answer(
  {
    version: NullEngine.Version,
    vertices: mesh.getTotalVertices(),
    joints: mesh.skeleton.bones.map((bone) => bone.name),
    targets: targets.map((target) => target.name),
    clips: loaded.animationGroups.map((group) => group.name),
    influences: mesh.numBoneInfluencers,
  },
  arrays,
);
