"""Bounds hold what they say they hold, and are not endless."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.ops.bounds import bounds
from avatar_runtime.avatar import Avatar, Blendshapes, Group, Rules, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.surface import binding_pose
from tests.avatars import COUNT, GROUPS, JOINTS, LATE_MORPHS, full_avatar, surface_avatar

PARTS = ("joints", "geometry", "correctives", "late_morphs", "joint_basis")
SURFACES = {
    "splatting_avatar": Rules("vertex_quaternion", scale="none"),  # log_area's growth is an estimate
    "gaussian_avatars": Rules("triangle_frame", position="triangle_frame", scale="triangle_linear"),
    "psavatar": Rules("bary_vertex_lbs", position="interpolated_normal"),
}
SLACK = 1e-6  # metres; float32 of positions and of the stored box


def corners(splats: Splats) -> npt.NDArray[np.float64]:
    """[N, 3] half-sizes of the boxes around three standard deviations, by quaternion sandwich."""
    w, v = splats.quat_wxyz[:, :1].astype(np.float64), splats.quat_wxyz[:, 1:].astype(np.float64)
    squares = np.zeros((len(w), 3))
    for axis in range(3):
        e = np.eye(3)[axis] * splats.scale[:, axis, None]
        t = 2 * np.cross(v, e)
        squares += (e + w * t + np.cross(v, t)) ** 2
    return 3 * np.sqrt(squares)


def overhang(splats: Splats, box: dict[str, list[float]]) -> float:
    """How far the splats reach out of the box, metres; negative inside."""
    half = corners(splats)
    out = np.maximum(np.array(box["min"]) - (splats.mean - half), splats.mean + half - np.array(box["max"]))
    return float(out.max())


def scaled(sparse: SparseRows, factor: float) -> SparseRows:
    return replace(sparse, values={k: v * np.float32(factor) for k, v in sparse.values.items()})


def lean(part: str, group: Group) -> Avatar:
    """The full avatar as one group of tiny splats, moved by joints and, thirtyfold, by one part only.

    Slack of one part or group then cannot hide that another was forgotten.
    """
    avatar = full_avatar()
    assert avatar.rig is not None
    b, rig = avatar.blendshapes, avatar.rig
    on = {name: 30.0 * (name == part) for name in (*PARTS, "appearance")}
    parts = ("geometry", "appearance", "correctives", "late_morphs")
    return check_avatar(
        replace(
            avatar,
            gaussians=replace(avatar.gaussians, log_scale=avatar.gaussians.log_scale - 5),
            clips=(),
            groups=(replace(group, first=0, count=COUNT),),
            blendshapes=Blendshapes(**{name: scaled(getattr(b, name), on[name]) for name in parts}),
            rig=replace(
                rig,
                morphs=scaled(rig.morphs, on["geometry"]),
                correctives=scaled(rig.correctives, on["correctives"]),
                late_morphs=scaled(rig.late_morphs, on["late_morphs"]),
                joint_basis=rig.joint_basis * np.float32(on["joint_basis"]),
            ),
        )
    )


def poses(avatar: Avatar, count: int, seed: int, alone: bool) -> list[Pose]:
    """Random weights up to the ends of their ranges, one joint turned by up to 30 degrees about any axis."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        weights = {
            e.name: float(rng.choice([*e.range, rng.uniform(*sorted(e.range))])) for e in avatar.expressions
        }
        if alone:
            name = str(rng.choice(list(weights)))
            weights = {name: weights[name]}
        axis = rng.normal(size=3)
        angle = np.radians(30) * rng.choice([1, rng.uniform()])
        turn = joint_rotation(axis / np.linalg.norm(axis) * angle)
        lids = {name: float(rng.choice([0, 1, rng.uniform()])) for name in LATE_MORPHS}
        found.append(Pose(weights, {str(rng.choice(JOINTS)): turn}, lids))
    return found


@pytest.mark.parametrize("seed", range(3))
def test_the_avatar_at_rest_fills_its_box_at_rest(seed: int) -> None:
    avatar = full_avatar(seed)
    box = bounds(avatar)["rest"]
    splats = Player(avatar).animate(Pose())
    assert abs(overhang(splats, box)) <= SLACK
    half = corners(splats)
    assert np.allclose(box["min"], (splats.mean - half).min(axis=0), rtol=0, atol=SLACK)
    assert np.allclose(box["max"], (splats.mean + half).max(axis=0), rtol=0, atol=SLACK)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.binding)
@pytest.mark.parametrize("part", PARTS)
def test_any_pose_stays_inside_the_swept_box(part: str, group: Group) -> None:
    avatar = lean(part, group)
    box = bounds(avatar)["swept"]
    player = Player(avatar)
    for pose in poses(avatar, 60, seed=len(part), alone=False):
        assert overhang(player.animate(pose), box) <= SLACK, pose


def test_splats_that_grow_stay_inside() -> None:
    avatar = lean("appearance", GROUPS[-1])
    box = bounds(avatar)["swept"]
    player = Player(avatar)
    for pose in poses(avatar, 60, seed=1, alone=True):
        assert overhang(player.animate(replace(pose, joints={})), box) <= SLACK


@pytest.mark.parametrize("seed", range(3))
def test_one_expression_at_a_time_stays_inside_with_everything_on(seed: int) -> None:
    avatar = full_avatar(seed)
    box = bounds(avatar)["swept"]
    player = Player(avatar)
    for pose in poses(avatar, 60, seed, alone=True):
        assert overhang(player.animate(pose), box) <= SLACK


def test_many_expressions_that_grow_a_splat_do_not_make_the_box_endless() -> None:
    """All of them at once add up in the exponent, to more than the earth; no face does that."""
    avatar = full_avatar()
    growing = scaled(avatar.blendshapes.appearance, 0)
    growing.values["log_scale"][:] = 5.0
    avatar = replace(avatar, blendshapes=replace(avatar.blendshapes, appearance=growing), clips=())
    box = bounds(avatar)["swept"]
    largest = 3 * float(np.exp(avatar.gaussians.log_scale.max() + 2 * 5.0))
    assert max(box["max"]) - min(box["min"]) < 2 * largest + 1


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("system", SURFACES)
def test_gaussians_on_a_surface_stay_inside(seed: int, system: str) -> None:
    avatar = replace(surface_avatar(seed, SURFACES[system]), clips=())
    box = bounds(avatar)["swept"]
    player = Player(avatar)
    for pose in poses(avatar, 60, seed, alone=False):
        assert overhang(player.animate(pose), box) <= SLACK


def test_the_corner_that_moves_most_counts() -> None:
    """One vertex a triangle flies off by a metre and takes the Gaussian along that sits on it."""
    avatar = replace(surface_avatar(rules=SURFACES["splatting_avatar"]), clips=())
    assert avatar.rig is not None and avatar.embedding is not None
    morphs = scaled(avatar.rig.morphs, 0)
    row = int(avatar.embedding.triangles[avatar.embedding.triangle[0], 0])
    entry = int(morphs.row_ptr[row])
    assert morphs.row_ptr[row + 1] > entry
    morphs.values["position"][entry] = [0, 1, 0]
    barycentric = avatar.embedding.barycentric.copy()
    barycentric[avatar.embedding.triangle == avatar.embedding.triangle[0]] = [1, 0, 0]
    avatar = replace(
        avatar,
        rig=replace(avatar.rig, morphs=morphs),
        embedding=replace(avatar.embedding, barycentric=barycentric),
    )
    name = avatar.expression_names[int(morphs.column[entry])]
    for weight in avatar.expressions[int(morphs.column[entry])].range:
        splats = Player(avatar).animate(Pose({name: weight}))
        assert overhang(splats, bounds(avatar)["swept"]) <= SLACK


def test_heights_in_triangles_grow_with_them() -> None:
    """An expression makes the whole mesh 1.8 times as large."""
    avatar = replace(surface_avatar(rules=SURFACES["gaussian_avatars"]), clips=())
    assert avatar.rig is not None and avatar.embedding is not None
    v, k = len(avatar.rig.vertices), len(avatar.expressions)
    morphs = SparseRows(
        np.arange(v + 1, dtype=np.uint32), np.zeros(v, np.uint16), {"position": 0.8 * avatar.rig.vertices}, k
    )
    offset = np.tile(np.float32([0, 30, 0]), (COUNT, 1))
    avatar = replace(
        avatar,
        rig=replace(avatar.rig, morphs=morphs),
        embedding=replace(avatar.embedding, local_offset=offset, canonical_vertices=avatar.rig.vertices),
    )
    mean, quat = binding_pose(avatar.embedding, avatar.rules, avatar.training_per_bundle)
    avatar = replace(avatar, gaussians=replace(avatar.gaussians, mean=mean, quat_wxyz=quat))
    splats = Player(avatar).animate(Pose({avatar.expression_names[0]: 1.0}))
    assert overhang(splats, bounds(avatar)["swept"]) <= SLACK


@pytest.mark.parametrize("avatar", [full_avatar(), surface_avatar()], ids=["skin", "surface"])
def test_every_frame_of_a_short_clip_is_inside(avatar: Avatar) -> None:
    """Moved a metre by a joint, which no turn would do."""
    clip = avatar.clips[0]
    moved = clip.joint_delta.copy()
    moved[-1, 0, 0, 3] += 1.0
    avatar = replace(avatar, clips=(replace(clip, joint_delta=moved),))
    box, player = bounds(avatar)["swept"], Player(avatar)
    assert box["max"][0] > 0.5 or min(box["min"]) < -0.5 or max(box["max"]) > 0.5
    for frame in range(clip.frames):
        pose = replace(frame_pose(avatar, avatar.clips[0], frame), world_from_avatar=np.eye(4))
        assert overhang(player.animate(pose), box) <= SLACK


def test_without_a_rig_nobody_knows_how_the_mesh_moves() -> None:
    box = bounds(surface_avatar(rigged=False))
    assert overhang(Player(surface_avatar(rigged=False)).animate(Pose()), box["swept"]) <= SLACK


@pytest.mark.parametrize("seed", range(20))
def test_swept_holds_rest_where_nothing_moves(seed: int) -> None:
    """Both come of the same numbers by other sums; rounding may not put one inside the other."""
    avatar = full_avatar(seed)
    rng = np.random.default_rng(seed)
    g = avatar.gaussians
    round_ones = replace(
        g,
        log_scale=np.repeat(rng.normal(-4, 1, (COUNT, 1)).astype(np.float32), 3, axis=1),
        quat_wxyz=rng.normal(size=(COUNT, 4)).astype(np.float32),
    )
    still = replace(
        avatar,
        gaussians=round_ones,
        groups=(Group("all", 0, COUNT, "none"),),
        blendshapes=Blendshapes(
            *(
                SparseRows.empty(COUNT, part.columns, {name: v.shape[1:] for name, v in part.values.items()})
                for part in vars(avatar.blendshapes).values()
            )
        ),
        rig=None,
        skin=SparseRows.empty(COUNT, 0, {"weight": ()}),
        clips=(),
    )
    box = bounds(still)
    assert (np.array(box["swept"]["min"]) <= box["rest"]["min"]).all()
    assert (np.array(box["swept"]["max"]) >= box["rest"]["max"]).all()
