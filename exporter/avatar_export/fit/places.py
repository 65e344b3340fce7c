"""Places that two files give: positions of embedded Gaussians against their .ply, joints against their regressor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.fit.judge import ACCEPT, REFUSED
from avatar_export.fit.known import TIMES
from avatar_export.fit.sampled import FEWEST, Bools, spread_rows
from avatar_export.notes.note import Note, doubt
from avatar_export.notes.text import text
from avatar_runtime.avatar import F32, I64, U32, Avatar, Embedding
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import ABSURD
from avatar_runtime.stages.surface import binding_pose

OFF = 0.1  # of an edge; a position farther from that of the .ply is another one
SOME = 0.01  # of the Gaussians
TRIED = 2000  # Gaussians
APART = 0.01  # of the avatar's size, that all may lie from their .ply
ORDERS = {
    (1, 2, 0): "1, 2, 0", (2, 0, 1): "2, 0, 1", (1, 0, 2): "1, 0, 2", (0, 2, 1): "0, 2, 1", (2, 1, 0): "2, 1, 0"
}  # fmt: skip
NEIGHBOURS = 10  # of a vertex, that are looked at
# steps that are counted exactly; vertices that a rough count of every step looks at
NEAR, ROUGH = 32, 1 << 19
SHARP = 1.08  # times more neighbours than at any other step has the right one


@ABSURD
def stored_positions(avatar: Avatar, stored: F32, cloud: Path, accept: bool, owner: str) -> list[Note]:
    """Doubts, if the .ply `cloud` has other positions `stored` [N, 3], metres, than the embedding gives.

    Raises AvatarError if weights or triangles are out of order for many Gaussians, unless `accept`."""
    embedding = avatar.embedding
    assert embedding is not None
    with np.errstate(all="ignore"):
        off = np.linalg.norm(stored - avatar.gaussians.mean, axis=1)
        apart, size = float(np.median(off)), float(np.ptp(avatar.gaussians.mean, axis=0).max())
        corner = embedding.canonical_vertices[embedding.vertex_ids]
        edge = np.linalg.norm(corner - corner[:, [1, 2, 0]], axis=2).mean(axis=1)
    rows = np.flatnonzero(off > OFF * edge)
    if len(rows) > max(FEWEST / 2, SOME * len(off)):
        cause = _reordered(avatar, stored, rows)
        if cause is not None:
            share = len(rows) / len(off)
            note = Note(
                "embedding_reordered",
                {"cloud": cloud.name, "share": share, **cause},
                "misfit" if share > REFUSED else "doubt",
            )
            if note.severity == "misfit" and not accept:
                raise AvatarError(f"{text(note)}; {ACCEPT}", file=cloud, owner=owner)
            return [note]
    return [doubt("other_positions", cloud=cloud.name, apart=apart)] if apart > APART * size else []


def _reordered(avatar: Avatar, stored: F32, rows: I64) -> Mapping[str, object] | None:
    """The order of weights, or the step of triangles, that brings the Gaussians `rows` to their positions `stored`."""
    assert avatar.embedding is not None
    rows = rows[spread_rows(len(rows), TRIED)]
    own = _taken(avatar.embedding, rows)
    base = float(np.median(np.linalg.norm(stored[rows] - avatar.gaussians.mean[rows], axis=1)))
    count = len(own.triangles)
    tried: list[tuple[dict[str, object], Embedding]] = [
        ({"order": name, "step": 0}, replace(own, barycentric=own.barycentric[:, list(order)]))
        for order, name in ORDERS.items()
    ]
    for step in (1, -1):
        moved = (own.triangle.astype(np.int64) + step) % count
        tried.append(({"order": None, "step": step}, replace(own, triangle=moved.astype(np.uint32))))
    for cause, embedding in tried:
        with np.errstate(all="ignore"):
            mean, _ = binding_pose(embedding, avatar.rules, avatar.training_per_bundle)
            left = float(np.median(np.linalg.norm(stored[rows] - mean, axis=1)))
        if left < base / TIMES:
            return cause
    return None


def _taken(embedding: Embedding, rows: I64) -> Embedding:
    """Some Gaussians of an embedding."""
    names = ("triangle", "barycentric", "displacement", "local_offset", "local_quat_wxyz")
    values = {name: getattr(embedding, name) for name in names}
    return replace(
        embedding, **{name: value[rows] if len(value) else value for name, value in values.items()}
    )


@ABSURD
def regressor_notes(regressor: F32, triangles: U32, names: Sequence[str], file: str) -> list[Note]:
    """A doubt, if columns of the joint `regressor` [J, V] of a body model seem to be shifted.

    The vertices that carry a joint are neighbours. If another step of the columns makes clearly more of them neighbours
    than theirs and than every other step does, the columns are shifted: all, or those of one joint.
    """
    vertices = regressor.shape[1]
    carried = _Carried.of(regressor, triangles)
    rough = carried.neighbours(np.arange(vertices), max(4, ROUGH // regressor.size))
    likely = [np.argsort(-count, kind="stable")[:NEAR] for count in (rough.sum(axis=0), *rough)]
    steps = np.unique(np.concatenate([np.arange(-NEAR, NEAR + 1), *likely]) % vertices)
    found = carried.neighbours(steps, vertices)
    for who, count in (("all joints", found.sum(axis=0)), *zip(names, found, strict=True)):
        best = int(count.argmax())
        rest = np.delete(count, best).max(initial=0)
        if steps[best] and count[best] >= max(FEWEST, SHARP * rest, rest + 3 * np.sqrt(rest)):
            by = int(-steps[best] if steps[best] <= vertices // 2 else vertices - steps[best])
            return [doubt("regressor_shifted", who=who, by=by, file=file)]
    return []


@dataclass(frozen=True)
class _Carried:
    """Which vertices carry which joint, and their neighbours."""

    carries: Bools  # [J, V]
    edge: I64  # [E, 2] both ways, in order of the first vertex
    first: I64  # [V + 1] rows of `edge`

    @staticmethod
    def of(regressor: F32, triangles: U32) -> _Carried:
        """From the weights that are not zero, and the sides of triangles."""
        edge = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]).astype(np.int64)
        edge = np.unique(np.concatenate([edge, edge[:, ::-1]]), axis=0)
        return _Carried(regressor != 0, edge, np.searchsorted(edge[:, 0], np.arange(regressor.shape[1] + 1)))

    def neighbours(self, steps: I64, most: int) -> I64:
        """[J, S] how many neighbours among them at most so many vertices of each joint have after each step."""
        vertices = self.carries.shape[1]
        count = np.zeros((len(self.carries), len(steps)), np.int64)
        for joint, row in enumerate(self.carries):
            own = np.flatnonzero(row)
            own = own[spread_rows(len(own), most)] if len(own) else own
            for part in np.array_split(np.arange(len(steps)), 1 + len(steps) * len(own) // ROUGH):
                step = steps[part, None]
                begin, end = (self.first[(own + step) % vertices + last][..., None] for last in (0, 1))
                at = begin + np.arange(NEIGHBOURS)
                other = self.edge[np.minimum(at, len(self.edge) - 1), 1]
                count[joint, part] = (row[(other - step[..., None]) % vertices] & (at < end)).sum(axis=(1, 2))
        return count
