"""How an avatar holds up in motion that it was not trained on: torn share, flicker and sharpness."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from rich.table import Table

from avatar_export import images
from avatar_export.playing import sequences
from avatar_runtime import F32, F64, I64, Avatar, AvatarError, Player, Pose, Rig, posed_mesh, resolve
from avatar_runtime.stages import joints
from avatar_trainer.asm.kernels.closest import nearest, triangle_tree
from avatar_trainer.captures.model import Capture
from avatar_trainer.kernels.neighbours import nearest_others

TRAINING, WHOLE, HELD_OUT = "training", "film", "held_out"  # the clips that `export` writes
NEIGHBOURS = 8
SHORTEST = 1e-3  # metres, added to neutral distances: splats that touch may part by a millimetre
SLACK = 1.25  # times the largest stretch over the training clip
INSIDE = 0.5  # of the accumulated opacity
SIZE = 256  # pixels along an edge of the images whose gradients are measured
HOW = (
    "torn_share: opacity-weighted share of (splat, frame) whose stretch, the largest of its distances to its 8 nearest "
    "neutral neighbours of the same group over (neutral distance + 1 mm), exceeds 1.25 times its largest over the "
    "training clip. flicker: mean length of the second difference of the splats' places in time, over that of the "
    "nearest point of the body model's neutral mesh, moved by that mesh. sharpness: mean length of the image gradient "
    "where alpha exceeds 0.5, over that of the held-out clip, from one camera"
)


@dataclass(frozen=True)
class Stability:
    """The three measures of a clip; `HOW` defines them."""

    frames: int
    splats: int
    torn_share: float
    flicker: float | None  # None: no mesh, fewer than three frames, or a mesh that does not move
    sharpness: float | None  # None: no held-out clip
    torn_by_group: dict[str, float]


def stability(avatar: Avatar, poses: Sequence[Pose], capture: Capture | None = None) -> Stability:
    """How `avatar` holds up in `poses`, of a clip that it was not trained on.

    capture: that of its training, whose mesh has nothing that training added; default: the avatar's own mesh. Raises
    AvatarError for an avatar without a training clip, and for a capture of another mesh or skeleton.
    """
    names = [clip.name for clip in avatar.clips]
    training = WHOLE if WHOLE in names and TRAINING not in names else TRAINING
    if training not in names:
        raise AvatarError(
            f"has no clip {TRAINING!r}, by which its splats' stretch is judged: `avatar-train export` adds it. Of an "
            f"avatar that was not trained here, convert it with --clip {TRAINING}.csv, a recording of its training",
            owner=avatar.name,
        )
    player = Player(avatar)
    stretch = Stretch(avatar, player)
    limit = np.zeros(avatar.gaussians.count)
    for pose in sequences.own_clip(avatar, training).poses:
        np.maximum(limit, stretch.of(player.animate(pose).mean), out=limit)
    torn, weight, places = np.zeros(len(limit)), np.zeros(len(limit)), []
    for pose in poses:
        splats = player.animate(pose)
        opacity = splats.opacity.astype(np.float64)
        torn += opacity * (stretch.of(splats.mean) > SLACK * limit)
        weight += opacity
        places.append(splats.mean)
    rows = {group.name: slice(group.first, group.first + group.count) for group in avatar.groups}
    return Stability(
        len(poses),
        len(limit),
        _share(torn, weight),
        _flicker(avatar, player, poses, places, _mesh_of(avatar, capture)),
        _sharpness(avatar, player, poses),
        {name: _share(torn[at], weight[at]) for name, at in rows.items()},
    )


def table(result: Stability) -> Table:
    """The measures as they are shown."""
    shown = Table(box=None, pad_edge=False)
    for title in ("frames", "splats", "torn share %", "flicker", "sharpness"):
        shown.add_column(title, justify="right")
    ratios = ("-" if value is None else f"{value:.3f}" for value in (result.flicker, result.sharpness))
    shown.add_row(str(result.frames), str(result.splats), f"{100 * result.torn_share:.3f}", *ratios)
    return shown


class Stretch:
    """Distances of splats to their neutral neighbours of the same group."""

    def __init__(self, avatar: Avatar, player: Player) -> None:
        neutral = player.animate(Pose()).mean.astype(np.float64)
        self._parts: list[tuple[slice, I64, F64]] = []  # rows, neighbours [n, 8], neutral distances [n, 8]
        for group in avatar.groups:
            at = slice(group.first, group.first + group.count)
            near = nearest_others(neutral[at], NEIGHBOURS)
            self._parts.append((at, near, _distances(neutral[at], near)))

    def of(self, mean: F32) -> F64:
        """[N] the largest of each splat's distances now over (its neutral distance + 1 mm); 0 without a neighbour."""
        result = np.zeros(len(mean))
        for at, near, neutral in self._parts:
            now = _distances(mean[at].astype(np.float64), near)
            result[at] = (now / (neutral + SHORTEST)).max(axis=1, initial=0.0)
        return result


def _distances(place: F64, near: I64) -> F64:
    """[n, k] of points [n, 3] to those of their rows `near` [n, k]."""
    result: F64 = np.linalg.norm(place[near] - place[:, None], axis=2)
    return result


def _share(part: F64, whole: F64) -> float:
    return float(part.sum() / whole.sum()) if whole.sum() > 0 else 0.0


def _mesh_of(avatar: Avatar, capture: Capture | None) -> Mesh | None:
    own = avatar.rig
    if capture is None:
        return None if own is None else Mesh(own, avatar.expression_names, avatar.eyelids)
    body = capture.rig
    if own is None or len(own.vertices) != len(body.vertices) or own.joint_names != body.joint_names:
        raise AvatarError(
            f"has a body model of {len(body.vertices)} vertices and {len(body.joint_names)} joints, which is not that "
            "of the bundle; name the capture of its training",
            file=capture.folder,
        )
    return Mesh(body, capture.expression_names, capture.eyelids)


class Mesh(NamedTuple):
    """A rig, and the names of its morphs."""

    rig: Rig
    expressions: Sequence[str]
    late_morphs: Sequence[str]

    def posed(self, avatar: Avatar, pose: Pose) -> F64:
        """[V, 3] in the world; what `avatar` has no name for stays at rest."""
        arrays = resolve(pose, avatar)
        own = replace(
            arrays,
            expression_weights=_ordered(avatar.expression_names, arrays.expression_weights, self.expressions),
            late_weights=_ordered(avatar.eyelids, arrays.late_weights, self.late_morphs),
        )
        vertices = posed_mesh(self.rig, own, joints.joints(self.rig, own)).astype(np.float64)
        result: F64 = vertices @ own.world_from_avatar[:3, :3].T + own.world_from_avatar[:3, 3]
        return result


def _ordered(names: Sequence[str], weights: F32, wanted: Sequence[str]) -> F32:
    """The weights [K] of `names` in the order `wanted`; 0 for a name without."""
    found = dict(zip(names, weights.tolist(), strict=True))
    return np.array([found.get(name, 0.0) for name in wanted], np.float32)


def _flicker(
    avatar: Avatar, player: Player, poses: Sequence[Pose], places: Sequence[F32], mesh: Mesh | None
) -> float | None:
    """The mean second difference of the splats over that of the mesh's points nearest to them in the neutral pose."""
    if mesh is None or len(poses) < 3:
        return None
    triangles = mesh.rig.triangles.astype(np.int64)
    at_rest = mesh.posed(avatar, Pose())
    found = nearest(player.animate(Pose()).mean, at_rest, triangle_tree(at_rest, triangles))
    corners = triangles[found.triangle]
    below = _trembling(
        np.einsum("nc,ncx->nx", found.barycentric, mesh.posed(avatar, pose)[corners]) for pose in poses
    )
    return _trembling(place.astype(np.float64) for place in places) / below if below > 0 else None


def _trembling(places: Iterable[F64]) -> float:
    """Mean length of x(t + 1) - 2 x(t) + x(t - 1) of points [N, 3] over all frames."""
    recent: list[F64] = []
    means = []
    for place in places:
        recent = [*recent[-2:], place]
        if len(recent) == 3:
            before, now, after = recent
            means.append(np.linalg.norm(after - 2 * now + before, axis=1).mean())
    return float(np.mean(means))


def _sharpness(avatar: Avatar, player: Player, poses: Sequence[Pose]) -> float | None:
    """The mean gradient inside alpha, relative to the held-out clip from the same camera."""
    if all(clip.name != HELD_OUT for clip in avatar.clips):
        return None
    camera = images.frame_camera(images.robust_box(player.animate(Pose()).mean), SIZE, SIZE)

    def gradient(shown: Iterable[Pose]) -> float:
        total, count = 0.0, 0
        for pose in shown:
            image = player.frame(pose, camera, (0.0, 0.0, 0.0)).image
            length = _gradient(np.clip(image.colour, 0, 1))[1 - image.transmittance > INSIDE]
            total, count = total + float(length.sum(dtype=np.float64)), count + length.size
        return total / max(count, 1)

    known = gradient(sequences.own_clip(avatar, HELD_OUT).poses)
    return gradient(poses) / known if known > 0 else None


def _gradient(colour: F32) -> F32:
    """[H, W] length of the central differences of the mean colour [H, W, 3]."""
    down, across = np.gradient(colour.mean(axis=2))
    result: F32 = np.hypot(down, across)
    return result
