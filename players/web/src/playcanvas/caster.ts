// What casts the shadow of an avatar in PlayCanvas.

import {
  BUFFER_DYNAMIC, BUFFER_STATIC, BoundingBox, CULLFACE_NONE, INDEXFORMAT_UINT32, IndexBuffer, Mesh, MeshInstance, PRIMITIVE_TRIANGLES, SEMANTIC_POSITION,
  StandardMaterial, TYPE_FLOAT32, Vec3, VertexBuffer, VertexFormat, type AppBase, type Entity, type Layer,
} from "playcanvas";
import type { RigMesh } from "../engine/rig_mesh.js";
import type { Pose } from "../pose/pose.js";

/** The mesh of a rig where its avatar is. Only the shadow maps of one layer see it. */
export class ShadowCaster {
  private readonly layer: Layer | null;
  private readonly vertices: VertexBuffer;
  private readonly mesh: Mesh;
  private readonly material = new StandardMaterial();
  private readonly instance: MeshInstance;
  private readonly box = new BoundingBox();
  private readonly low = new Vec3();
  private readonly high = new Vec3();

  constructor(
    { graphicsDevice: device, scene }: AppBase,
    layer: number,
    head: Entity,
    private readonly rig: RigMesh,
    private readonly pose: Pose,
  ) {
    const { positions, triangles } = rig;
    const format = new VertexFormat(device, [{ semantic: SEMANTIC_POSITION, components: 3, type: TYPE_FLOAT32 }]);
    this.vertices = new VertexBuffer(device, format, positions.length / 3, { usage: BUFFER_DYNAMIC, data: positions.buffer });
    this.mesh = new Mesh(device);
    this.mesh.vertexBuffer = this.vertices;
    this.mesh.indexBuffer[0] = new IndexBuffer(device, INDEXFORMAT_UINT32, triangles.length, BUFFER_STATIC, triangles.buffer);
    this.mesh.primitive[0] = { type: PRIMITIVE_TRIANGLES, base: 0, baseVertex: 0, count: triangles.length, indexed: true };
    this.material.cull = CULLFACE_NONE;
    this.material.update();
    this.instance = new MeshInstance(this.mesh, this.material, head);
    this.instance.castShadow = true;
    this.layer = scene.layers.getLayerById(layer);
    this.layer?.addShadowCasters([this.instance]);
  }

  /** To be called before each picture. `shown`: whether the avatar is. */
  takePose(shown: boolean): void {
    this.instance.visible = shown;
    const { rig, low, high } = this;
    if (!shown || !rig.update(this.pose, false)) return;
    this.vertices.setData(rig.positions.buffer);
    low.fromArray(rig.low);
    high.fromArray(rig.high);
    this.box.setMinMax(low, high);
    this.mesh.aabb = this.box; // it counts this as a change
  }

  destroy(): void {
    this.layer?.removeShadowCasters([this.instance]);
    this.instance.destroy(); // and the mesh
    this.material.destroy();
    this.rig.dispose();
  }
}
