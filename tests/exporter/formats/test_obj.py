"""What the .obj reader makes of good and of bad text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from avatar_export.formats.mesh_files import read_mesh
from avatar_export.formats.obj import TriangleMesh, parse_obj, read_obj
from tests.exporter.readers.splatting_files import FACES, VERTICES, obj_text
from tests.exporter.refusals import refused

TEXT = obj_text().encode()
CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def _parse(text: bytes) -> TriangleMesh:
    return parse_obj(text.splitlines(keepends=True), "a.obj")


@pytest.mark.parametrize(
    "faces",
    [b"f 1 2 3\nf 4 3 2\n", b"f 1/7 2/8 3/9\nf 4/1 3/1 2/1\n", b"f 1//7 2//8 3//9\nf 4//1 3//1 2//1\n",
     b"f 1/2/3 2/2/3 3/2/3\nf 4/1/1 3/1/1 2/1/1\n", b"f -4 -3 -2\nf -1 -2 -3\n", b"f -4 -3 -2\nv 9 9 9\nf 4 3 2\n",
     b"g body\nusemtl x\ns off\nf\t1  2 3 # one\r\n  f 4 3 2\t\r\nl 1 2\np 1\n"],
)  # fmt: skip
def test_ways_to_write_a_face(faces: bytes) -> None:
    mesh = _parse(b"mtllib m\no thing\nvn 0 0 1\nvt 0 0\n" + CORNERS + faces)
    assert mesh.triangles.tolist() == [[0, 1, 2], [3, 2, 1]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *((text, "has no vertices") for text in (b"", b"f 1 2 3\n")),
        (CORNERS, "has no faces"),
        (CORNERS + b"f 1 2 3 4\n", "a.obj: line 5: the face has more than three corners; triangulate"),
        *((CORNERS + f"f 1 2 {word}\n".encode(), f"line 5: '{word}' is not a corner")
          for word in ("0", "x", "/3", "1.5", "9" * 20)),
        (CORNERS + b"\nf 1 2 3\nf 1 2 5\n", r"line 7: face 1 has corners 1, 2, 5, but there are vertices 1\.\.4"),
        (b"v 0 0\nf 1 1 1\n", "line 1: 'v' needs three numbers, got '0 0'"),
        *((CORNERS + b"v " + word + b" 0 0\nf 1 2 3\n", "vertex 5 is not finite") for word in (b"nan", b"1e39")),
    ],
)  # fmt: skip
def test_bad_text(text: bytes, message: str) -> None:
    refused(message, _parse, text)


def test_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(TEXT)
    np.savez(tmp_path / "a.npz", vertices=np.round(VERTICES, 6), faces=FACES.astype("u1"))
    for mesh in (read_obj(path), read_mesh(path), read_mesh(tmp_path / "a.npz")):
        assert mesh.vertices.dtype == np.float32 and mesh.triangles.dtype == np.uint32
        assert np.array_equal(mesh.vertices, np.round(VERTICES, 6).astype("f4"))
        assert np.array_equal(mesh.triangles, FACES)
    refused("no such file", read_mesh, tmp_path / "none.obj")
    refused("is not a mesh file that can be read", read_mesh, tmp_path)
    monkeypatch.setattr("avatar_export.formats.obj.MAX_BYTES", 100)
    refused(f"is {len(TEXT)} bytes long; up to 100 are read", read_obj, path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((4, 2))}, r"vertices: expected floats \[rows, 3\], got float64\[4, 2\]"),
        ({"vertices": np.full((9, 3), 1e39)}, r"vertices\[0\]: is not finite"),
        ({"faces": np.zeros((4, 3))}, "faces: expected whole numbers"),
        ({"faces": np.array([[0, 1, 2], [0, 1, 6]])}, r"faces\[1\]: is \[0, 1, 6\], but there are 6 vertices"),
        ({"faces": None}, "needs arrays vertices and faces, but holds vertices"),
    ],
)  # fmt: skip
def test_bad_npz_meshes(change: dict[str, object], message: str, tmp_path: Path) -> None:
    arrays = {"vertices": VERTICES, "faces": FACES, **change}
    np.savez(tmp_path / "a.npz", **{key: value for key, value in arrays.items() if value is not None})
    refused(message, read_mesh, tmp_path / "a.npz")
