"""The Gaussian Blendshapes vectors as model parts, built from the plain arrays without any reader."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from avatar_runtime.avatar import Avatar, Blendshapes, Expression, Gaussians, Group, Rig, Rules, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.pose import PoseArrays
from avatar_runtime.rotation import homogeneous, translation_matrix
from avatar_runtime.stages.bind import Bound, bind
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.groups import group_transforms
from avatar_runtime.stages.joints import Joints
from tests.golden import FRAMES, Array, BlendshapesGolden

JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
LOWER_MIX = {"root": 0.0130787707, "neck": 0.0426467828, "jaw": 0.944269622}
EXPRESSIONS = 57  # what the body model moves; the Gaussians have deltas for the first 50
EYELIDS = ("left", "right")


@dataclass(frozen=True)
class GoldenModel:
    """The vectors, the body model as a `Rig` and the dumped folders as an `Avatar`."""

    source: BlendshapesGolden

    @cached_property
    def body(self) -> dict[str, Array]:
        return self.source.body_model()

    @cached_property
    def static(self) -> dict[str, Array]:
        return self.source.static()

    @cached_property
    def frames(self) -> list[dict[str, Array]]:
        return [self.source.frame(index) for index in FRAMES]

    @cached_property
    def anchors(self) -> Array:
        return self.body["faces"][self.body["back_of_head_faces"]].reshape(-1)

    def posed_anchors(self, frame: dict[str, Array]) -> Array:
        return frame["mesh_vertices"][np.searchsorted(self.source.vertex_rows, self.anchors)]

    @cached_property
    def rig(self) -> Rig:
        """J(expression) = regressor (template + identity + expression), as the body model defines it."""
        body = {
            key: value.astype(np.float64) for key, value in self.body.items() if value.dtype == np.float32
        }
        identity = self.frames[0]["shape"][:20].astype(np.float64)
        vertices = body["v_template"] + body["shapedirs_identity"] @ identity
        rest = body["J_regressor"] @ vertices
        parents = self.body["parents"]
        offset = rest - np.where(parents[:, None] >= 0, rest[parents], 0)
        expression = np.moveaxis(body["shapedirs_expression"], 2, 1)  # [V, K, 3]
        eyelids = np.stack([body["l_eyelid"], body["r_eyelid"]], axis=1)
        return Rig(
            vertices=vertices.astype(np.float32),
            triangles=self.body["faces"].astype(np.uint32),
            morphs=sparse({"position": expression}),
            correctives=sparse({"position": np.moveaxis(body["posedirs"], 2, 1)}),
            late_morphs=sparse({"position": eyelids}),
            skin=sparse({"weight": body["lbs_weights"]}),
            joint_names=JOINTS,
            parents=parents,
            rest_local=translation_matrix(offset.astype(np.float32)),
            inverse_bind_matrix=translation_matrix(-rest.astype(np.float32)),
            joint_basis=np.einsum("jv,vkc->kjc", body["J_regressor"], expression).astype(np.float32),
            corrective_joints=np.arange(1, 5, dtype=np.int32),
            anchor_vertices=self.anchors.astype(np.uint32),
        )

    @cached_property
    def avatar(self) -> Avatar:
        """The dumped folders as an avatar: face, upper and lower teeth."""
        face, upper, lower = (self._folder(name) for name in ("fix", "mouth0", "mouth1"))
        n, mouth = len(face["pos"]), len(upper["pos"]) + len(lower["pos"])

        def all_groups(key: str) -> Array:
            return np.concatenate([part[key] for part in (face, upper, lower)])

        def columns(key: str) -> Array:
            """[N, K, ...] of a face array that ends in its columns; no entries in the mouth's rows."""
            dense = np.moveaxis(face[key], -1, 1)
            return np.concatenate([dense, np.zeros((mouth, *dense.shape[1:]), np.float32)])

        def expressions(key: str) -> Array:
            dense = columns(key)
            return np.concatenate([dense, np.zeros((n + mouth, EXPRESSIONS - 50, *dense.shape[2:]))], axis=1)

        groups = (
            Group("face", 0, n, "skin"),
            Group("upper", n, len(upper["pos"]), "anchor"),
            Group("lower", n + len(upper["pos"]), len(lower["pos"]), "joint_mix", LOWER_MIX),
        )
        appearance = {"log_scale": "scale_t", "opacity_logit": "opacity_t", "sh": "shs_t"}
        appearance_dense = {name: expressions(key) for name, key in appearance.items()}
        appearance_dense["opacity_logit"] = appearance_dense["opacity_logit"][..., 0]
        avatar = Avatar(
            name="golden",
            gaussians=Gaussians(
                all_groups("pos"),
                all_groups("scale"),
                all_groups("rot"),
                all_groups("opacity")[:, 0],
                all_groups("shs"),
            ),
            groups=groups,
            rules=Rules(),
            expressions=tuple(Expression(name) for name in self.body["expression_names"].tolist()),
            late_morph_names=EYELIDS,
            blendshapes=Blendshapes(
                sparse({"mean": expressions("xyz_t"), "quat_wxyz": expressions("rot_t")}),
                sparse(appearance_dense),
                sparse({"mean": columns("pos_t")}),
                sparse({"mean": columns("eyelid")}),
            ),
            skin=sparse({"weight": columns("W")}),
            rig=self.rig,
            sh_degree=3,
        )
        return check_avatar(avatar)

    def pose(self, frame: dict[str, Array]) -> PoseArrays:
        """The frame's inputs as the stages take them."""
        return PoseArrays(
            frame["exp"][:EXPRESSIONS],
            frame["eyelids"],
            homogeneous(frame["joint_rotations"].astype(np.float64)),
            np.eye(4),
        )

    def _folder(self, prefix: str) -> dict[str, Array]:
        (folder,) = (path for path in self.source.viewer.iterdir() if path.name.startswith(prefix))
        arrays = {path.stem: np.load(path) for path in folder.glob("*.npy")}
        if "pos_t" in arrays:  # the one array with its columns first
            arrays["pos_t"] = np.moveaxis(arrays["pos_t"], 0, -1)
        return arrays


def golden_joints(frame: dict[str, Array]) -> Joints:
    """The released code's own result of stage `joints`."""
    return Joints(frame["A"], frame["pose_feature"], frame["joints_rest"], frame["joints_posed"])


def bound(model: GoldenModel, frame: dict[str, Array], world: Array | None = None) -> Bound:
    """Stages `blend` and `bind` after the released code's joints and anchor vertices."""
    pose = model.pose(frame)
    blended = blend(model.avatar.gaussians, model.avatar.blendshapes, pose.expression_weights)
    anchors, state = model.posed_anchors(frame), golden_joints(frame)
    groups = group_transforms(model.avatar, state, anchors)
    world = np.eye(4) if world is None else world
    return bind(
        model.avatar, blended, state.skin_matrix, state.pose_feature, pose.late_weights, groups, world
    )


def sparse(dense: Mapping[str, Array]) -> SparseRows:
    """SparseRows of dense arrays [rows, columns, ...]; an entry stands where any attribute is not zero."""
    first = next(iter(dense.values()))
    rows, columns = first.shape[:2]
    used = np.zeros((rows, columns), bool)
    for value in dense.values():
        used |= (value != 0).reshape(rows, columns, -1).any(axis=2)
    row_ptr = np.concatenate([[0], np.cumsum(used.sum(axis=1))]).astype(np.uint32)
    column = np.nonzero(used)[1].astype(np.uint16)
    return SparseRows(row_ptr, column, {k: v[used].astype(np.float32) for k, v in dense.items()}, columns)
