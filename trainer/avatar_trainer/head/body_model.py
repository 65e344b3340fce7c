"""A body model in FLAME's layout made from the head: five joints, skin weights, the jaw is a joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from avatar_runtime import rotation as runtime_rotation
from avatar_trainer.head.mesh import Array, smoothstep
from avatar_trainer.head.model import EYE_TURN, Head, neck_height, smooth_over_mesh

JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
PARENTS = (-1, 0, 1, 1, 1)
ROOT, NECK, JAW, LEFT_EYE, RIGHT_EYE = range(5)
ROOT_POSITION = (0.0, -0.155, -0.015)
NECK_POSITION = (0.0, -0.075, -0.005)
# Share of root, neck and jaw in the transform of the lower teeth, the constants of Gaussian Blendshapes.
LOWER_TEETH_MIX = (0.0130787707, 0.0426467828, 0.944269622)
JAW_SHAPES = ("jawOpen", "jawForward", "jawLeft", "jawRight")
# The only shape that the Gaussians lack: the jaw joint alone reproduces it to within 3 mm at the lips.
MESH_ONLY = "jawRight"
GAUSSIAN_SHAPES = 50
FEATURES = 36  # 9 entries of R - I for each of four joints
ANCHOR_FACES = 56
REGRESSOR_SUPPORT = 600  # vertices that carry one joint


@dataclass(frozen=True)
class BodyModel:
    """FLAME's arrays for V vertices, K expressions, M identity modes, in metres."""

    v_template: Array  # f32 [V, 3]
    faces: Array  # i32 [F, 3]
    face_part: Array  # u8 [F]
    part_names: tuple[str, ...]
    shapedirs_identity: Array  # f32 [V, 3, M]
    shapedirs_expression: Array  # f32 [V, 3, K]
    expression_names: tuple[str, ...]
    posedirs: Array  # f32 [V, 3, 36]
    J_regressor: Array  # f32 [5, V]
    lbs_weights: Array  # f32 [V, 5]
    l_eyelid: Array  # f64 [V, 3]
    r_eyelid: Array  # f64 [V, 3]
    back_of_head_faces: Array  # i32 [A]
    jaw_turn: dict[str, Array]  # shape name -> rotation vector [3] of the jaw joint at full weight

    @property
    def joints(self) -> Array:
        """Rest joints [5, 3] of the template."""
        result: Array = self.J_regressor @ self.v_template
        return result


def kabsch(source: Array, target: Array) -> Array:
    """The rotation [3, 3] that best takes the rows of source to those of target, both about the origin."""
    u, _, vt = np.linalg.svd(target.T @ source)
    sign = np.array([1, 1, np.linalg.det(u @ vt)])
    result: Array = (u * sign) @ vt
    return result


def rotvec(rotation: Array) -> Array:
    """Rotation vector of a matrix [3, 3] that turns by less than half a turn."""
    skew = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = np.linalg.norm(skew) / 2
    angle = np.arctan2(sine, (np.trace(rotation) - 1) / 2)
    result: Array = skew / 2 * (angle / sine if sine > 1e-9 else 1.0)
    return result


def fit_jaw(head: Head) -> tuple[Array, dict[str, Array]]:
    """Jaw joint [3] and its rotation vector for each jaw shape, from the rigid motion of the lower teeth.

    The teeth follow the joint only by LOWER_TEETH_MIX[2], so the joint turns that much further.
    The joint lies on the axis of jawOpen, in the middle of the face.
    """
    teeth = head.in_part("lower_teeth")
    x = head.vertices[teeth]
    goal = {name: x + head.expression(name)[teeth] / LOWER_TEETH_MIX[JAW] for name in JAW_SHAPES}
    opened = goal["jawOpen"]
    rotation = kabsch(x - x.mean(axis=0), opened - opened.mean(axis=0))
    shift = opened.mean(axis=0) - rotation @ x.mean(axis=0)
    joint = np.linalg.pinv(np.eye(3) - rotation, rcond=1e-3) @ shift
    joint[0] = 0.0
    turn = {name: rotvec(kabsch(x - joint, y - joint)) for name, y in goal.items()}
    turn["jawOpen"][1:] = 0.0
    return joint, turn


def skin_weights(head: Head, joint: Array, jaw_open: Array) -> Array:
    """Weights [V, 5]; the jaw's: how far jawOpen moves a vertex along the arc the jaw joint would take it."""
    arm = head.vertices - joint
    arc = arm @ runtime_rotation.matrix_from_rotvec(jaw_open).T - arm
    along = np.sum(arc * head.expression("jawOpen"), axis=1) / np.maximum(np.sum(arc * arc, axis=1), 1e-5)
    jaw = smooth_over_mesh(head, np.clip(along, 0, 1), 8)
    weights = np.zeros((len(arm), 5))
    weights[:, ROOT] = smoothstep(neck_height(head.vertices), -0.065, -0.15)
    weights[:, JAW] = jaw * (1 - weights[:, ROOT])
    weights[:, NECK] = 1 - weights[:, ROOT] - weights[:, JAW]
    for part, row in {
        "upper_teeth": (0, 1, 0, 0, 0),
        "upper_gums": (0, 1, 0, 0, 0),
        "lower_teeth": (*LOWER_TEETH_MIX, 0, 0),
        "lower_gums": (*LOWER_TEETH_MIX, 0, 0),
        "left_eye": (0, 0, 0, 1, 0),
        "right_eye": (0, 0, 0, 0, 1),
    }.items():
        weights[head.in_part(part)] = row
    result: Array = weights / weights.sum(axis=1, keepdims=True)
    return result


def residual_shape(head: Head, name: str, joint: Array, turn: Array, jaw_weight: Array) -> Array:
    """The remainder of a jaw shape [V, 3] after the joint's rotation; added before skinning, so it is rotated back."""
    rotation = runtime_rotation.matrix_from_rotvec(turn)
    skin = np.eye(3) + jaw_weight[:, None, None] * (rotation - np.eye(3))
    shift = jaw_weight[:, None] * (joint - rotation @ joint)
    goal = head.vertices + head.expression(name) - shift
    result: Array = np.linalg.solve(skin, goal[..., None])[..., 0] - head.vertices
    return result


def regressor(head: Head, joints: Array, shapes: Array, moving: bool) -> Array:
    """Rows [5, V] that sum to one and give the joints: least change to equal weights on nearby vertices.

    The vertices are ones that none of the shapes [V, 3, K] moves; with `moving`, simply the
    nearest ones, so that expressions move the joints.
    """
    still = np.abs(shapes).max(axis=(1, 2)) < 1e-6
    rows = np.zeros((5, len(head.vertices)))
    for j, joint in enumerate(joints):
        pool = still | moving
        if j >= LEFT_EYE and not moving:
            pool = head.in_part(("left_eye", "right_eye")[j - LEFT_EYE])
        distance = np.where(pool, np.linalg.norm((head.vertices - joint) * (0.5, 1, 1), axis=1), np.inf)
        support = np.argsort(distance, kind="stable")[: min(REGRESSOR_SUPPORT, int(pool.sum()))]
        constraint = np.c_[head.vertices[support], np.ones(len(support))].T
        equal = np.full(len(support), 1 / len(support))
        missing = np.append(joint, 1) - constraint @ equal
        rows[j, support] = equal + constraint.T @ np.linalg.solve(constraint @ constraint.T, missing)
    return rows


def back_of_head(head: Head) -> Array:
    """The ANCHOR_FACES triangles nearest to the middle of the back of the head."""
    centre = head.vertices[head.triangles].mean(axis=1)
    distance = np.linalg.norm(centre - (0.0, 0.05, -0.1), axis=1)
    chosen = np.argsort(np.where(head.triangles_in("head"), distance, np.inf), kind="stable")[:ANCHOR_FACES]
    return np.sort(chosen).astype(np.int32)


def build_body_model(head: Head, *, moving_joints: bool = False, posedirs: Array | None = None) -> BodyModel:
    """The body model of a head; `posedirs` [V, 3, 36] are zero unless given."""
    jaw, turn = fit_jaw(head)
    joints = np.array([ROOT_POSITION, NECK_POSITION, jaw, *head.eye_centres])
    weights = skin_weights(head, jaw, turn["jawOpen"])
    names = [n for n in head.expression_names if n != MESH_ONLY] + [MESH_ONLY]
    shapes = {n: head.expression(n) for n in names}
    for name in JAW_SHAPES:
        shapes[name] = residual_shape(head, name, jaw, turn[name], weights[:, JAW])
    shapedirs = np.stack([shapes[n] for n in names], axis=-1).astype(np.float32)
    v = len(head.vertices)
    return BodyModel(
        v_template=head.vertices.astype(np.float32),
        faces=head.triangles.astype(np.int32),
        face_part=head.part.astype(np.uint8),
        part_names=head.part_names,
        shapedirs_identity=np.ascontiguousarray(np.moveaxis(head.identity, 0, -1), np.float32),
        shapedirs_expression=shapedirs,
        expression_names=tuple(names),
        posedirs=np.zeros((v, 3, FEATURES), np.float32) if posedirs is None else posedirs.astype(np.float32),
        J_regressor=regressor(head, joints, shapedirs, moving_joints).astype(np.float32),
        lbs_weights=weights.astype(np.float32),
        l_eyelid=head.expression("eyeBlinkLeft").astype(np.float64),
        r_eyelid=head.expression("eyeBlinkRight").astype(np.float64),
        back_of_head_faces=back_of_head(head),
        jaw_turn=turn,
    )


def driving(body: BodyModel, inputs: tuple[str, ...]) -> dict[str, Any]:
    """The matrix from ARKit weights to this body: expressions by name, jaw and eyes by rotation vectors."""
    rows: dict[str, dict[str, float]] = {f"expression/{n}": {n: 1.0} for n in body.expression_names}
    for name, turn in body.jaw_turn.items():
        for axis, angle in zip("xyz", turn.tolist(), strict=True):
            rows.setdefault(f"joint/jaw/{axis}", {})[name] = angle
    for name, angles in EYE_TURN.items():
        eye = "leftEye" if name.endswith("Left") else "rightEye"
        for axis, angle in zip("xy", angles, strict=True):
            rows.setdefault(f"joint/{eye}/{axis}", {})[name] = angle
    matrix = [[row.get(name, 0.0) for name in inputs] for row in rows.values()]
    return {"inputs": list(inputs), "outputs": list(rows), "matrix": matrix}
