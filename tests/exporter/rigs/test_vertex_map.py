"""The same vertices in two files of one surface: every method that finds them, and other surfaces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.rigs.rig_file import read_rig_file
from avatar_export.rigs.vertex_map import VertexMap, vertex_map
from avatar_runtime.avatar import Rig, SparseRows
from tests.exporter.refusals import refused
from tests.exporter.rigs import rig_files
from tests.exporter.rigs.rig_files import Part, rig_glb
from tests.oracles.lbs import rodrigues

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


def _mapped(rig: Rig, triangles: Array, vertices: Array, ids: Any = None) -> VertexMap:
    return vertex_map(rig, ids, triangles.astype("u4"), vertices.astype("f4"))


POSED, SHEET = rig_files.posed(1.0, 0.7), rig_files.sheet()
USED = np.unique(SHEET)
FORMS = {"whole": rig_files.whole(), "split": rig_files.split(), "soup": rig_files.soup()}


@pytest.mark.parametrize("form", ["split", "soup"])
@pytest.mark.parametrize("ids", ["attribute", "uv", "flipped"])
def test_vertex_ids_in_the_file(tmp_path: Path, form: str, ids: str) -> None:
    rig, vertex_ids, rows = _rig(tmp_path, FORMS[form], ids=ids)
    found = _mapped(rig, SHEET, POSED, vertex_ids)
    assert found.how == "the vertex ids in the file" and not found.disagreeing
    np.testing.assert_array_equal(rows[found.rows[USED]], USED)
    for wrong in (vertex_ids + 1, vertex_ids * 0 - 5, vertex_ids[::-1]):
        found = _mapped(rig, SHEET, POSED, wrong)
        assert found.how == "their connectivity"
        np.testing.assert_array_equal(rows[found.rows[USED]], USED)


def test_the_order_of_triangles(tmp_path: Path) -> None:
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
    vertices, triangles, order = rig_files.shuffled(POSED)
    found = _mapped(rig, triangles, vertices)
    assert found.how == "their connectivity" and not found.disagreeing
    np.testing.assert_array_equal(rows[found.rows], order)


def _joined(blocks: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    first = np.cumsum([0, *(len(points) for points, _ in blocks)])
    triangles = np.concatenate([t + at for (_, t), at in zip(blocks, first, strict=False)])
    return np.concatenate([points for points, _ in blocks]), triangles


def _body() -> tuple[Array, Array]:
    """A surface without symmetry, about a metre large."""
    return rig_files.vertices().astype(np.float64)[np.unique(rig_files.sheet())], _local(rig_files.sheet())


CARD = np.array([[0, 0, 0], [0.02, 0, 0], [0.02, 0.03, 0], [0, 0.03, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])


def test_alike_parts_by_where_they_are() -> None:
    cards = [(CARD[0] + at, CARD[1]) for at in np.random.default_rng(7).uniform(0, 0.8, (30, 3))]
    points, triangles = _joined([_body(), *cards])
    posed = 4 * points @ rodrigues(np.array([0.3, 0.2, 0.5])).T + [1, 2, 3]
    posed += np.random.default_rng(7).normal(0, 1e-3, posed.shape)
    vertices, shuffled, order = rig_files.shuffled(posed, triangles)
    np.testing.assert_array_equal(_mapped(_bare(points, triangles), shuffled, vertices).rows, order)


def _local(triangles: Array) -> Array:
    return np.searchsorted(np.unique(triangles), triangles)


OTHERS: dict[str, Any] = {
    "a triangle turned over": lambda t: np.concatenate([t[:-1], t[-1:, ::-1]]),
    "a triangle less": lambda t: t[1:],
    "mirrored": lambda t: t[:, ::-1],
    "an edge turned": lambda t: np.concatenate([[[0, 10, 1], [9, 10, 0]], t[2:]]),
    "another vertex in one": lambda t: np.concatenate([[[t[0, 0], t[0, 1], 62]], t[1:]]),
}


@pytest.mark.parametrize("case", OTHERS)
def test_other_surfaces_are_refused(tmp_path: Path, case: str) -> None:
    rig, ids, _ = _rig(tmp_path, rig_files.split(), ids="attribute")
    says = "the mesh has 6.*with seams closed.*no numbering maps one to the other"
    refused(says, _mapped, rig, OTHERS[case](SHEET), POSED, ids)
