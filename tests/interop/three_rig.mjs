// Poses a rigged .glb with three.js, without a browser. Job and answer as in clients.py.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { answer, indexOf, job, readBytes, takePoses } from "./job.mjs";

globalThis.self ??= globalThis; // GLTFLoader asks it for URL

const data = readBytes(job.glb);
const gltf = await new GLTFLoader().parseAsync(data.buffer, "");
const { json, associations } = gltf.parser;
// Nodes by their names in the file: GLTFLoader strips what its animation paths cannot hold from object names.
const nodes = new Map();
gltf.scene.traverse((object) => {
  const index = associations.get(object)?.nodes;
  if (index !== undefined) nodes.set(json.nodes[index].name, object);
});
const mesh = [...nodes.values()].find((object) => object.isSkinnedMesh);
const { geometry, skeleton } = mesh;
const named = (object) => json.nodes[associations.get(object).nodes].name;
const rest = [...nodes.values()].map((node) => [node, node.position.clone(), node.quaternion.clone(), node.scale.clone()]);

function toRest() {
  for (const [node, position, quaternion, scale] of rest) {
    node.position.copy(position);
    node.quaternion.copy(quaternion);
    node.scale.copy(scale);
  }
  mesh.morphTargetInfluences?.fill(0);
}

function setPose(pose) {
  for (const [name, { translation, rotation_xyzw, scale }] of Object.entries(pose.nodes)) {
    const node = nodes.get(name);
    node.position.fromArray(translation);
    node.quaternion.fromArray(rotation_xyzw);
    node.scale.fromArray(scale);
  }
  pose.weights.forEach((weight, k) => (mesh.morphTargetInfluences[k] = weight));
}

function posed() {
  gltf.scene.updateMatrixWorld(true);
  skeleton.update();
  const count = geometry.attributes.position.count;
  const out = new Float32Array(3 * count);
  const vertex = new THREE.Vector3();
  for (let i = 0; i < count; i++) {
    mesh.getVertexPosition(i, vertex).applyMatrix4(mesh.matrixWorld).toArray(out, 3 * i);
  }
  return out;
}

const arrays = { triangles: Uint32Array.from(geometry.index.array) };
for (const [name, attribute] of Object.entries(geometry.attributes)) {
  arrays[`attribute/${name}`] = Float32Array.from(attribute.array);
}
takePoses(arrays, toRest, setPose, posed);
for (const { clip, times } of job.clips) {
  toRest();
  const mixer = new THREE.AnimationMixer(gltf.scene);
  const action = mixer.clipAction(gltf.animations[indexOf(clip, gltf.animations)]);
  action.setLoop(THREE.LoopOnce).clampWhenFinished = true;
  action.play();
  times.forEach((time, k) => {
    mixer.setTime(time);
    arrays[`clip/${clip}/${k}`] = posed();
  });
  mixer.stopAllAction();
}

answer(
  {
    version: THREE.REVISION,
    vertices: geometry.attributes.position.count,
    joints: skeleton.bones.map(named),
    targets: Object.keys(mesh.morphTargetDictionary ?? {}),
    clips: gltf.animations.map((clip) => clip.name),
  },
  arrays,
);
