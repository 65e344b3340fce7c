// What casts the shadow of an avatar in three.js.

import { Box3, BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial, Sphere } from "three";
import type { RigMesh } from "../engine/rig_mesh.js";
import type { Pose } from "../pose/pose.js";

/** The mesh of a rig as a child of its avatar. Only shadow maps see it. */
export class ShadowCaster extends Mesh<BufferGeometry, MeshBasicMaterial> {
  constructor(
    private readonly rig: RigMesh,
    private readonly pose: Pose,
  ) {
    const geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(rig.triangles, 1));
    geometry.setAttribute("position", new BufferAttribute(rig.positions, 3).setUsage(DynamicDrawUsage));
    geometry.boundingBox = new Box3();
    geometry.boundingSphere = new Sphere();
    geometry.setDrawRange(0, 0);
    super(geometry, new MeshBasicMaterial({ side: DoubleSide }));
    this.name = "shadow";
    this.castShadow = true;
    this.onBeforeShadow = () => geometry.setDrawRange(0, Infinity);
    this.onAfterShadow = () => geometry.setDrawRange(0, 0);
  }

  /** A renderer calls it for the whole scene, before it uploads attributes and draws shadow maps. */
  override updateMatrixWorld(force?: boolean): void {
    if (isVisible(this)) this.takePose();
    super.updateMatrixWorld(force);
  }

  override raycast(): void {}

  override dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
    this.rig.dispose();
    super.dispose();
  }

  private takePose(): void {
    const { rig, geometry } = this;
    if (!rig.update(this.pose, false)) return;
    (geometry.attributes["position"] as BufferAttribute).needsUpdate = true;
    const box = geometry.boundingBox as Box3;
    box.min.fromArray(rig.low);
    box.max.fromArray(rig.high);
    box.getBoundingSphere(geometry.boundingSphere as Sphere);
  }
}

function isVisible(object: Mesh): boolean {
  for (let at: typeof object.parent = object; at !== null; at = at.parent) if (!at.visible) return false;
  return true;
}
