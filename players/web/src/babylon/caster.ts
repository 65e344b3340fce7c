// What casts the shadow of an avatar in Babylon.js.

import { VertexBuffer } from "@babylonjs/core/Buffers/buffer.js";
import { Material } from "@babylonjs/core/Materials/material.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { Mesh } from "@babylonjs/core/Meshes/mesh.js";
import type { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import type { RigMesh } from "../engine/rig_mesh.js";
import type { Pose } from "../pose/pose.js";

/** The mesh of a rig as a child of its avatar. Only shadow maps to which it is added see it. */
export class ShadowCaster extends Mesh {
  private readonly least = new Vector3();
  private readonly most = new Vector3();

  /** @internal `AvatarScene.addAvatar` makes them. */
  constructor(
    head: TransformNode,
    private readonly rig: RigMesh,
    private readonly posed: Pose,
  ) {
    super(`${head.name}.shadow`, head.getScene(), head);
    this.setVerticesData(VertexBuffer.PositionKind, rig.positions, true);
    this.setIndices(rig.triangles);
    this.material = new Material(this.name, this.getScene(), true);
    this.material.backFaceCulling = false;
    this.layerMask = 0; // of no camera
    this.isPickable = false;
    this.doNotSerialize = true;
  }

  /** @internal To be called before each shadow map. `shown`: whether the avatar is. */
  takePose(shown: boolean): void {
    this.isVisible = shown;
    const { rig, least, most } = this;
    if (!shown || !rig.update(this.posed, !this.getScene().useRightHandedSystem)) return;
    this.updateVerticesData(VertexBuffer.PositionKind, rig.positions);
    this.getBoundingInfo().reConstruct(least.fromArray(rig.low), most.fromArray(rig.high), this.getWorldMatrix());
  }

  override dispose(doNotRecurse?: boolean): void {
    this.rig.dispose();
    super.dispose(doNotRecurse, true);
  }
}
