import { load } from "avatar-export-player";
import sample from "avatar-export-player/sample.avatar?url";
import { AvatarScene } from "avatar-export-player/three";
import { Color, Mesh, MeshBasicMaterial, PerspectiveCamera, Scene, TorusGeometry, WebGLRenderer } from "three";

const renderer = new WebGLRenderer();
renderer.setPixelRatio(devicePixelRatio);
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);

const camera = new PerspectiveCamera(30, innerWidth / innerHeight, 0.01, 10);
camera.position.set(0, 0, 0.9);
const scene = new Scene();
scene.background = new Color(0xdddddd);
scene.add(new Mesh(new TorusGeometry(0.2, 0.01), new MeshBasicMaterial({ color: 0x336699 })));

const avatars = await AvatarScene.create(renderer);
scene.add(avatars);
const head = avatars.addAvatar(await load(sample));

renderer.setAnimationLoop((now) => {
  head.pose.setExpression("jawOpen", 0.25 + 0.25 * Math.sin(now / 300));
  renderer.render(scene, camera);
});
