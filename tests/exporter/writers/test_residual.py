"""The residual of engines in the manifest is what an oracle measures on rig.glb."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.writers.residual import engine_residual
from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.engine_pose import bind_nodes, engine_pose, engine_rest, local_transforms
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.asm_faces import asm_avatar
from tests.avatars import VERTICES, full_avatar
from tests.oracles.gltf_pose import File, quaternion_matrix
from tests.rigs import (
    distance,
    rig_of,
    runtime_mesh,
    scaled_at_rest,
    state_of,
    strongest,
    with_rig,
    without_late,
    written,
)

Array = npt.NDArray[Any]


@pytest.mark.parametrize("influences", [4, 8])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1.3, 0.8, 1.0)])
def test_the_residual_is_what_the_oracle_measures(influences: int, scale: tuple[float, float, float]) -> None:
    """And each part of it is what is left when the others are taken away."""
    avatar = scaled_at_rest(full_avatar(), scale)
    said = engine_residual(avatar, influences)
    poses = list(residual_poses(avatar))
    assert said["poses"] == len(poses) == 12 + 5 + 3

    def measure(a: Avatar, sets: int, late: bool) -> float:
        file = File(written(a, 4 * sets))
        shown = [p if late else without_late(p) for p in poses]
        states = [state_of(a, engine_pose(a, p)) for p in shown]
        pairs = zip(states, shown, strict=True)
        return 1e3 * max(distance(file.posed(s, sets), runtime_mesh(a, file, p)) for s, p in pairs)

    rounding = 6e-4  # of three decimals, and of float32
    assert abs(said["residual_mm"] - measure(avatar, influences // 4, True)) <= rounding
    assert abs(said["shear_mm"] - measure(avatar, 2, False)) <= rounding
    unsheared = full_avatar()
    plain = engine_residual(unsheared, influences)
    assert abs(plain["truncation_mm"] - measure(unsheared, influences // 4, False)) <= rounding
    assert abs(plain["late_morph_mm"] - measure(unsheared, 2, True)) <= rounding
    assert (said["shear_mm"] > 1) == (scale[0] != 1) and plain["shear_mm"] == 0
    assert (said["truncation_mm"] > 1) == (influences == 4) and said["late_morph_mm"] > 1


def test_a_rig_that_gltf_can_say_has_no_residual() -> None:
    avatar = strongest(replace(full_avatar(), clips=()), 4)
    said = engine_residual(with_rig(avatar, late_morphs=SparseRows.empty(VERTICES, 2, {"position": (3,)})))
    parts = ("residual_mm", "truncation_mm", "late_morph_mm", "shear_mm")
    assert said == {"poses": 12, **dict.fromkeys(parts, 0.0)}


def test_the_residual_of_a_rig_beyond_float32_is_refused() -> None:
    avatar = full_avatar()
    with pytest.raises(AvatarError, match="float32"):
        engine_residual(with_rig(avatar, vertices=np.sign(rig_of(avatar).vertices) * np.float32(3e38)))


def unsheared_mesh(avatar: Avatar, pose: Pose) -> Array:
    """Vertices [V, 3] where a child's scale is its own times its parent's, axis by axis, and its rotation likewise."""
    rig, found = rig_of(avatar), engine_pose(avatar, pose)
    skin = np.zeros((rig.joint_count, 4, 4))
    parts: list[tuple[Array, Array, Array]] = []  # rotation, scale, place of each joint in the mesh
    for j, parent in enumerate(rig.parents.tolist()):
        turn, scale, place = quaternion_matrix(found.rotation_xyzw[j]), found.scale[j], found.translation[j]
        if parent >= 0:
            above_turn, above_scale, above_place = parts[parent]
            place = above_place + above_turn @ (above_scale * place)
            turn, scale = above_turn @ turn, above_scale * scale
        parts.append((turn, scale, place))
        node = np.eye(4)
        node[:3, :3], node[:3, 3] = turn @ np.diag(scale), place
        skin[j] = node @ rig.inverse_bind_matrix[j]
    result = np.zeros((len(rig.vertices), 3))
    for v, point in enumerate(rig.vertices):
        for entry in range(rig.skin.row_ptr[v], rig.skin.row_ptr[v + 1]):
            moved = skin[rig.skin.column[entry]] @ np.append(point, 1)
            result[v] += rig.skin.values["weight"][entry] * moved[:3]
    return result


def test_no_shear_is_what_composing_parts_loses() -> None:
    avatar = asm_avatar()  # bind transforms have an even scale: rigid ones make the same of it
    rig, rest = rig_of(avatar), engine_rest(avatar)
    rigid = np.linalg.inv(bind_nodes(rig)).astype(np.float32)
    local = local_transforms(rest.translation, rest.rotation_xyzw, rest.scale).astype(np.float32)
    even = replace(avatar, rig=replace(rig, inverse_bind_matrix=rigid, rest_local=local))
    said = engine_residual(even, 8)
    player = Player(even, "reference")
    off = [unsheared_mesh(even, p) - player.mesh(p) for p in residual_poses(even)]
    assert len(off) == said["poses"] == 1 + 1 + 5 + 1
    worst = 1e3 * max(float(np.linalg.norm(o, axis=1).max()) for o in off)
    assert worst > 1 and abs(said["no_shear_mm"] - worst) <= 2e-3
