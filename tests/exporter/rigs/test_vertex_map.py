"""The same vertices in two files of one surface: every method that finds them, and other surfaces."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.rigs.mesh_matching import Surface, isomorphism
from avatar_export.rigs.rig_file import read_rig_file
from avatar_export.rigs.vertex_map import VertexMap, vertex_map
from avatar_runtime.avatar import Rig, SparseRows
from avatar_runtime.io.errors import AvatarError
from tests.exporter.rigs import rig_files
from tests.exporter.rigs.rig_files import Part, rig_glb
from tests.measured import Measure
from tests.oracles.lbs import rodrigues
from tests.shared_data import shared

Array = npt.NDArray[Any]


def _rig(folder: Path, parts: list[Part], **options: Any) -> tuple[Rig, Any, Array]:
    """(rig, vertex ids, vertex of the character that each of the rig's is)."""
    path = folder / "made.glb"
    path.write_bytes(rig_glb(parts, **options))
    found = read_rig_file(path)
    return found.rig, found.vertex_ids, np.concatenate([part.rows for part in parts])


def _bare(vertices: Array, triangles: Array) -> Rig:
    """A rig of a surface alone."""
    n = len(vertices)
    nothing = SparseRows.empty(n, 0, {"position": (3,)})
    skin = SparseRows(np.arange(n + 1, dtype="u4"), np.zeros(n, "u2"), {"weight": np.ones(n, "f4")}, 1)
    eye = np.eye(4, dtype="f4")[None]
    return Rig(
        vertices.astype("f4"), triangles.astype("u4"), nothing, nothing, nothing, skin, ("root",),
        np.array([-1], "i4"), eye, eye, np.zeros((0, 1, 3), "f4"), np.zeros(0, "i4"), np.zeros(0, "u4"),
    )  # fmt: skip


def _shuffled(vertices: Array, triangles: Array, seed: int = 1) -> tuple[Array, Array, Array]:
    """(vertices, triangles, old row of each), vertices, triangles and their first corners in another order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(vertices))
    triangles = np.argsort(order)[rng.permutation(triangles)]
    turn = rng.integers(0, 3, (len(triangles), 1))
    turned = np.take_along_axis(triangles, (turn + np.arange(3)) % 3, axis=1)
    return vertices[order].astype("f4"), turned.astype("u4"), order


def _mapped(rig: Rig, triangles: Array, vertices: Array, ids: Any = None) -> VertexMap:
    return vertex_map(rig, ids, triangles.astype("u4"), vertices.astype("f4"))


POSED = rig_files.posed(1.0, 0.7)
FORMS = {"whole": rig_files.whole(), "split": rig_files.split(), "soup": rig_files.soup()}


def test_the_same_numbering_in_another_order_of_triangles(tmp_path: Path) -> None:
    rig, _, _ = _rig(tmp_path, rig_files.whole())
    found = _mapped(rig, rig_files.sheet()[::-1, [1, 2, 0]], POSED)
    assert found.how == "the same numbering" and found.rows.tolist() == list(range(63))


@pytest.mark.parametrize("form", ["split", "soup"])
@pytest.mark.parametrize("ids", ["attribute", "uv", "flipped"])
def test_vertex_ids_in_the_file(tmp_path: Path, form: str, ids: str) -> None:
    rig, vertex_ids, rows = _rig(tmp_path, FORMS[form], ids=ids)
    found = _mapped(rig, rig_files.sheet(), POSED, vertex_ids)
    assert found.how == "the vertex ids in the file" and not found.disagreeing
    used = np.unique(rig_files.sheet())
    np.testing.assert_array_equal(rows[found.rows[used]], used)


def test_wrong_ids_do_not_lead_astray(tmp_path: Path) -> None:
    rig, vertex_ids, rows = _rig(tmp_path, rig_files.split(), ids="attribute")
    for wrong in (vertex_ids + 1, vertex_ids * 0 - 5, vertex_ids[::-1]):
        found = _mapped(rig, rig_files.sheet(), POSED, wrong)
        assert found.how == "their connectivity"
        used = np.unique(rig_files.sheet())
        np.testing.assert_array_equal(rows[found.rows[used]], used)


def test_the_order_of_triangles(tmp_path: Path) -> None:
    """Vertices split and shuffled, but the triangles where they were: symmetric surfaces are found, too."""
    rng = np.random.default_rng(2)
    square = np.array([[0, 1, 2], [0, 2, 3]])
    soup = rng.permutation(6)
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    corner = np.zeros((6, 3))
    corner[soup] = points[square.reshape(-1)]
    rig = _bare(corner, soup.reshape(2, 3))
    found = _mapped(rig, square, points[[2, 3, 0, 1]])  # places would say the other way round
    assert found.how == "the order of the triangles"
    np.testing.assert_array_equal(corner[found.rows], points)


@pytest.mark.parametrize("form", FORMS)
def test_connectivity(tmp_path: Path, form: str) -> None:
    rig, _, rows = _rig(tmp_path, FORMS[form])
    vertices, triangles, order = rig_files.shuffled_mesh(POSED)
    found = _mapped(rig, triangles, vertices)
    assert found.how == "their connectivity" and not found.disagreeing
    np.testing.assert_array_equal(rows[found.rows], order)


def test_copies_that_differ_are_counted(tmp_path: Path) -> None:
    """A seam whose two sides have other weights: closed by place alone, and said so."""
    parts = rig_files.split()
    rig, _, rows = _rig(tmp_path, parts)
    weight = rig.skin.values["weight"].copy()
    first = rig.skin.row_ptr[len(parts[0].rows)]
    weight[:first] *= 0.5  # of the whole first part
    rig = replace(rig, skin=replace(rig.skin, values={"weight": weight}))
    vertices, triangles, order = rig_files.shuffled_mesh(POSED)
    found = _mapped(rig, triangles, vertices)
    np.testing.assert_array_equal(rows[found.rows], order)
    assert found.disagreeing == len(np.intersect1d(parts[0].rows, parts[1].rows)) > 0
    assert (found.rows[np.isin(order, parts[0].rows)] < len(parts[0].rows)).all(), "the first copy is taken"


def test_vertices_that_touch_stay_two(tmp_path: Path) -> None:
    """Closed lips: two vertices in one place that other morphs part are not welded."""
    points = rig_files.vertices().copy()
    points[40] = points[22]
    rig, _, rows = _rig(tmp_path, rig_files.split())
    rig = replace(rig, vertices=points[rows].astype("f4"))
    vertices, triangles, order = rig_files.shuffled_mesh(POSED)
    np.testing.assert_array_equal(rows[_mapped(rig, triangles, vertices).rows], order)


def _joined(blocks: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    first = np.cumsum([0, *(len(points) for points, _ in blocks)])
    triangles = np.concatenate([t + at for (_, t), at in zip(blocks, first, strict=False)])
    return np.concatenate([points for points, _ in blocks]), triangles


def _body() -> tuple[Array, Array]:
    """A surface without symmetry, about a metre large."""
    return rig_files.vertices().astype(np.float64)[np.unique(rig_files.sheet())], _local(rig_files.sheet())


def _regular(rows: int, columns: int) -> tuple[Array, Array]:
    """A grid that looks the same turned by half a turn."""
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]))
    x, y = np.divmod(at.ravel(), columns)
    points = np.stack([x / rows, y / columns, 0.1 * np.sin(4 * x / rows)], axis=1)
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


CARD = (
    np.array([[0, 0, 0], [0.02, 0, 0], [0.02, 0.03, 0], [0, 0.03, 0.0]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
)


def _cards(count: int, spread: float) -> list[tuple[Array, Array]]:
    rng = np.random.default_rng(7)
    return [(CARD[0] + rng.uniform(0, spread, 3), CARD[1]) for _ in range(count)]


def test_alike_parts_by_where_they_are() -> None:
    """Two eyeballs, symmetric about their axes, and loose cards, on a body without symmetry, posed."""
    eye, eye_triangles = _globe(8, 12)
    eyes = [(0.03 * eye + at, eye_triangles) for at in ([0.2, 0.8, 0.1], [0.6, 0.8, 0.1])]
    points, triangles = _joined([_body(), *eyes, *_cards(30, 0.8)])
    posed = points @ rodrigues(np.array([0.2, 1.1, -0.3])).T * 4 + [1, 2, 3]
    posed += np.random.default_rng(7).normal(0, 1e-3, posed.shape)
    vertices, shuffled, order = _shuffled(posed, triangles)
    np.testing.assert_array_equal(_mapped(_bare(points, triangles), shuffled, vertices).rows, order)


def test_alike_parts_on_a_bent_body() -> None:
    """Where a part is, is said by the vertices near it: a body bent by 150 degrees has no one place."""
    body, faces = _regular(40, 40)
    near = body[np.random.default_rng(3).permutation(len(body))[:30]] + [0, 0, 0.03]
    points, triangles = _joined([(body, faces[:-1]), *((CARD[0] + at, CARD[1]) for at in near)])
    angle = np.radians(150) * points[:, 1]  # more, the higher up
    arm = points[:, 2] + 1 / np.radians(150)  # so that nothing is stretched
    bent = np.stack([points[:, 0], np.sin(angle) * arm, np.cos(angle) * arm], axis=1)
    vertices, shuffled, order = _shuffled(bent, triangles)
    np.testing.assert_array_equal(_mapped(_bare(points, triangles), shuffled, vertices).rows, order)


def test_the_largest_part_is_placed_first() -> None:
    """Nothing has a colour of its own: the body's place is taken from all of it, the cards' from the body."""
    points, triangles = _joined([_regular(12, 9), *_cards(30, 0.8)])
    posed = points @ rodrigues(np.array([0.3, 0.2, 0.5])).T
    vertices, shuffled, order = _shuffled(posed, triangles)
    np.testing.assert_array_equal(_mapped(_bare(points, triangles), shuffled, vertices).rows, order)


def test_alike_parts_that_cannot_be_told_apart_are_still_matched() -> None:
    """Cards nearer to one another than they moved: any of them will do, each one once."""
    points, triangles = _joined([_body(), *_cards(30, 0.001)])
    posed = points + np.random.default_rng(7).normal(0, 0.01, points.shape)
    vertices, shuffled, order = _shuffled(posed, triangles)
    rows = _mapped(_bare(points, triangles), shuffled, vertices).rows
    assert len(np.unique(rows)) == len(points)
    body = order < len(_body()[0])
    np.testing.assert_array_equal(rows[body], order[body])


def test_left_and_right_differ_without_any_place() -> None:
    """A surface and its mirror image joined: turning direction alone tells the sides apart."""
    points, triangles = _body()
    edge = np.flatnonzero(points[:, 0] < 0.05)
    other = np.arange(len(points)) + len(points)
    other[edge] = edge
    mirrored = np.concatenate([triangles, other[triangles][:, ::-1]])
    used, mirrored = np.unique(mirrored, return_inverse=True)
    mirrored = mirrored.reshape(-1, 3)
    nowhere = np.zeros((len(used), 3), "f4")
    _, shuffled, order = _shuffled(nowhere, mirrored)
    found = isomorphism(
        Surface(mirrored, len(used), nowhere), Surface(shuffled.astype(np.int64), len(used), nowhere)
    )
    assert found is not None
    np.testing.assert_array_equal(order[found], np.arange(len(used)))


def _local(triangles: Array) -> Array:
    return np.searchsorted(np.unique(triangles), triangles)


def _globe(rings: int, sides: int) -> tuple[Array, Array]:
    up, around = (np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(sides) / sides)
    ring = np.stack([np.outer(np.sin(up), np.cos(around)), np.outer(np.sin(up), np.sin(around)),
                     np.outer(np.cos(up), np.ones(sides))], axis=-1).reshape(-1, 3)  # fmt: skip
    points = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    at = np.arange((rings - 1) * sides).reshape(rings - 1, sides)
    a, b, c, d = at[:-1], np.roll(at, -1, 1)[:-1], np.roll(at, -1, 1)[1:], at[1:]
    caps = [
        np.stack([np.full(sides, len(ring)), at[0], np.roll(at[0], -1)], axis=1),
        np.stack([np.full(sides, len(ring) + 1), np.roll(at[-1], -1), at[-1]], axis=1),
    ]
    faces = [np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, c, b], -1).reshape(-1, 3)]
    return points, np.concatenate([*faces, *caps])


OTHERS: dict[str, Any] = {
    "a triangle turned over": lambda t: np.concatenate([t[:-1], t[-1:, ::-1]]),
    "a triangle less": lambda t: t[1:],
    "an edge turned": lambda t: np.concatenate([[[0, 10, 1], [9, 10, 0]], t[2:]]),
    "another vertex in one": lambda t: np.concatenate([[[t[0, 0], t[0, 1], 62]], t[1:]]),
}


@pytest.mark.parametrize("case", OTHERS)
def test_other_surfaces_are_refused(tmp_path: Path, case: str) -> None:
    rig, ids, _ = _rig(tmp_path, rig_files.split(), ids="attribute")
    with pytest.raises(AvatarError) as caught:
        _mapped(rig, OTHERS[case](rig_files.sheet()), POSED, ids)
    text = str(caught.value)
    assert "no numbering maps one to the other" in text
    assert "with seams closed" in text and "the mesh has 6" in text and "\n" not in text


def test_a_mirrored_surface_is_another() -> None:
    rig = _bare(rig_files.vertices(), rig_files.sheet())
    with pytest.raises(AvatarError, match="no numbering"):
        _mapped(rig, rig_files.sheet()[:, ::-1], POSED)


def test_nothing_to_match() -> None:
    empty = Surface(np.zeros((0, 3), np.int64), 4, np.zeros((4, 3), "f4"))
    assert isomorphism(empty, empty) is not None
    found = _mapped(_bare(np.zeros((4, 3)), np.zeros((0, 3))), np.zeros((0, 3)), np.zeros((2, 3)))
    assert found.rows.tolist() == [0, 0]


def test_a_real_head(measured: Measure) -> None:
    """26,719 vertices, eyes and teeth among them alike; the mesh turned, with noise, and another person's."""
    data = np.load(shared("head/ict_lps_head.npz"))
    points, triangles = data["vertices"] / 100, data["triangles"].astype(int)
    rng = np.random.default_rng(1)
    turned = points @ rodrigues(np.array([0.3, 1.2, 0.1])).T + rng.normal(0, 1e-4, points.shape)
    used = np.unique(triangles)
    for posed in (turned, data["generic_vertices"] / 100):
        vertices, shuffled, order = _shuffled(posed, triangles)
        start = time.perf_counter()
        found = _mapped(_bare(points, triangles), shuffled, vertices)
        measured("vertex map of 26,719 vertices s", time.perf_counter() - start)
        there = np.isin(order, used)
        np.testing.assert_array_equal(found.rows[there], order[there])
