"""Learns an avatar that is embedded in a mesh: places, rules, and what the drivers do to sizes and colours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from avatar_export.distill.build import APPEARANCE, Builder
from avatar_export.distill.dumps.frames import Rows
from avatar_export.distill.embed import (
    TRIED,
    Place,
    Posed,
    Turned,
    local_quats,
    places,
    posed_meshes,
    spread,
    surface_of,
    under,
    unscaled,
)
from avatar_export.distill.learn import Fitted, Still, Task, ridges, sample_rows
from avatar_export.distill.mesh import Mesh
from avatar_export.distill.sh_turn import turned_sh
from avatar_export.distill.solve import fit_groups
from avatar_runtime.avatar import F32, F64, I64, Avatar, Embedding, Group, Rules
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.rules import AREA_SCALES, VERTEX_ROTATIONS
from avatar_runtime.stages.surface import Surface, binding_pose, triangle_shape
from avatar_schema import constants

BOUND = 5e-4  # metres: where the median Gaussian wanders more on its triangle, the mesh does not carry it
KEPT = ("log_scale", "opacity_logit", "sh")


@dataclass(frozen=True)
class Choice:
    """The mesh and the rules that explain a sample of the Gaussians best."""

    canonical: F32  # [V, 3]
    rules: Rules
    frames: I64  # in which places and rotations are settled
    mesh: Posed  # in these frames
    sizes: F64  # [F, T] of the triangles in all frames
    wander: float  # metres, of the median Gaussian of the sample


def learn_embedded(task: Task, mesh: Mesh, progress: Callable[[str], None] = lambda _: None) -> Avatar | None:
    """The avatar on `mesh`; None where the Gaussians do not follow it."""
    assert task.skeleton is not None
    progress("choosing how the mesh carries the Gaussians")
    rows = sample_rows(task.layout.rows)
    sample = task.rows(rows)
    choice = choose(task, mesh, sample)
    if choice.wander > BOUND:
        return None
    place, still = _still(task, choice, sample)
    ridge = ridges(task, still, KEPT)
    builder = Builder(task)
    found: list[tuple[Place, F32]] = []
    for block in task.blocks():
        progress(f"Gaussians {block.start} to {block.stop} of {task.layout.rows} on the mesh")
        place, still = _still(task, choice, task.rows(block))
        columns = task.columns.at(task.fitted)
        constant, driven = {}, {}
        none = np.zeros((block.stop - block.start, columns.turns.shape[1]), bool)
        for name in KEPT:
            constant[name], driven[name], _ = fit_groups(
                columns, none, still.values[name][task.fitted], ridge[name]
            )
        builder.add_embedded(
            block, Fitted(None, constant, driven, np.zeros((len(none), 0, 9, 3), np.float32))
        )
        found.append((place, still.values["quat_wxyz"][0]))
    return _avatar(task, mesh, choice, builder, found)


def choose(task: Task, mesh: Mesh, sample: Rows) -> Choice:
    """Canonical mesh, rotation rule and scale rule with the least unexplained motion of a sample."""
    assert task.skeleton is not None
    u = 1 / task.dumps.unit
    frames = task.fitted[np.unique(np.linspace(0, len(task.fitted) - 1, TRIED).astype(int))]
    vertices = list(mesh.vertices(task.dumps, task.skeleton, frames))
    meshes = posed_meshes(mesh.rig.vertices, mesh.rig.triangles, vertices, u)
    place = places(meshes, sample.mean[frames])
    best: tuple[float, F32, Rules, Turned] | None = None
    for canonical in (mesh.rig.vertices, next(mesh.vertices(task.dumps, task.skeleton, task.fitted[:1]))):
        for rotation in VERTEX_ROTATIONS:
            rules = Rules(rotation=rotation, sh_direction=task.sh_direction)
            turned = under(surface_of(canonical, meshes.triangles, place.triangle, rules, u, place), vertices)
            cost = spread(local_quats(turned, sample.quat_wxyz[frames]))
            if best is None or cost < best[0]:
                best = (cost, canonical, rules, turned)
    assert best is not None
    log_scale = sample.log_scale[frames]
    costs = {rule: spread(unscaled(rule, best[3], log_scale, u, _damping())) for rule in AREA_SCALES}
    rules = replace(best[2], scale=min(costs, key=lambda rule: costs[rule]))
    sizes = np.stack(
        [
            triangle_shape(one, meshes.triangles, rules).size
            for one in mesh.vertices(task.dumps, task.skeleton, np.arange(task.dumps.drivers.frames))
        ]
    )
    return Choice(best[1], rules, frames, meshes, sizes, float(np.sqrt(np.median(place.cost))))


def _damping() -> float:
    return float(constants()["area_damping"])


def _still(task: Task, choice: Choice, rows: Rows) -> tuple[Place, Still]:
    """Where the Gaussians sit, and their numbers without what the mesh does to them; one rotation each."""
    u = 1 / task.dumps.unit
    place = places(choice.mesh, rows.mean[choice.frames])
    surface = surface_of(choice.canonical, choice.mesh.triangles, place.triangle, choice.rules, u, place)
    turned = under(surface, choice.mesh.vertices)
    quat = local_quats(turned, rows.quat_wxyz[choice.frames]).mean(axis=0)
    quat /= np.maximum(np.linalg.norm(quat, axis=1, keepdims=True), np.float32(1e-12))
    stretched = Turned(turned.quat_wxyz, choice.sizes[:, place.triangle], turned.canonical_size)
    scale = unscaled(choice.rules.scale, stretched, rows.log_scale, u, _damping())
    sh = rows.sh
    if task.sh_turns:
        sh = _sh(task, choice, surface, rows)
    values = {
        "quat_wxyz": quat[None],
        "log_scale": scale,
        "opacity_logit": rows.opacity_logit[..., None],
        "sh": sh.reshape(*sh.shape[:2], -1),
    }
    return place, Still(None, values)


def _sh(task: Task, choice: Choice, surface: Surface, rows: Rows) -> F32:
    """SH of the settled frames, turned back and averaged: [F, n, K, 3], equal in all frames."""
    turned = under(surface, choice.mesh.vertices)
    back = matrix_from_quat(turned.quat_wxyz).swapaxes(-1, -2)
    still = turned_sh(rows.sh[choice.frames], back.astype(np.float32)).mean(axis=0)
    result: F32 = np.broadcast_to(still, rows.sh.shape).copy()
    result[:, :, 0] = rows.sh[:, :, 0]  # the first coefficient does not turn
    return result


def _avatar(
    task: Task, mesh: Mesh, choice: Choice, builder: Builder, found: list[tuple[Place, F32]]
) -> Avatar:
    n = task.layout.rows
    embedding = Embedding(
        canonical_vertices=choice.canonical.astype(np.float32),
        triangles=mesh.rig.triangles,
        triangle=np.concatenate([place.triangle for place, _ in found]).astype(np.uint32),
        barycentric=np.concatenate([place.barycentric for place, _ in found]).astype(np.float32),
        displacement=np.concatenate([place.displacement for place, _ in found]).astype(np.float32),
        local_offset=np.zeros((0, 3), np.float32),
        local_quat_wxyz=np.concatenate([quat for _, quat in found]).astype(np.float32),
    )
    avatar = builder.avatar(mesh.rig)
    mean, quat = binding_pose(embedding, choice.rules, avatar.training_per_bundle)
    return replace(
        avatar,
        gaussians=replace(avatar.gaussians, mean=mean, quat_wxyz=quat),
        groups=(Group("surface", 0, n, "surface"),),
        rules=choice.rules,
        embedding=embedding,
    )


assert set(KEPT) == set(APPEARANCE)
