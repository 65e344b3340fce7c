"""What the .obj reader makes of good and of bad text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.formats.mesh_files import read_mesh
from avatar_export.formats.obj import TriangleMesh, parse_obj, read_obj
from avatar_runtime.io.errors import AvatarError
from tests.exporter.readers import splatting_files
from tests.hostile import MANGLING, mangled, only_avatar_errors, peak_bytes

TEXT = splatting_files.obj_text().encode()
CORNERS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


def _parse(text: bytes) -> TriangleMesh:
    return parse_obj(text.splitlines(keepends=True), "a.obj")


def test_order_and_values_survive() -> None:
    mesh = _parse(TEXT)
    assert mesh.vertices.dtype == np.float32 and mesh.triangles.dtype == np.uint32
    assert np.array_equal(mesh.vertices, np.round(splatting_files.VERTICES, 6).astype("f4"))
    assert np.array_equal(mesh.triangles, splatting_files.FACES)


@given(st.lists(st.floats(-1e4, 1e4, width=32), min_size=3, max_size=3))
def test_text_is_rounded_once(values: list[float]) -> None:
    """Double precision of the text, then float32: parsing straight to float32 can differ in the last bit."""
    words = [f"{value:.6f}" for value in values]
    mesh = _parse(CORNERS + f"v {' '.join(words)}\nf 1 2 3\n".encode())
    assert mesh.vertices[4].tolist() == [float(np.float32(float(word))) for word in words]


@pytest.mark.parametrize(
    "faces",
    [b"f 1 2 3\nf 4 3 2\n", b"f 1/7 2/8 3/9\nf 4/1 3/1 2/1\n", b"f 1//7 2//8 3//9\nf 4//1 3//1 2//1\n",
     b"f 1/2/3 2/2/3 3/2/3\nf 4/1/1 3/1/1 2/1/1\n", b"f -4 -3 -2\nf -1 -2 -3\n",
     b"g body\nusemtl x\ns off\nf\t1  2 3 # one\r\n  f 4 3 2\t\r\nl 1 2\np 1\n"],
)  # fmt: skip
def test_ways_to_write_a_face(faces: bytes) -> None:
    assert _parse(b"mtllib m\no thing\nvn 0 0 1\nvt 0 0\n" + CORNERS + faces).triangles.tolist() == [
        [0, 1, 2],
        [3, 2, 1],
    ]


def test_a_negative_index_counts_from_its_line() -> None:
    assert _parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 9 9 9\n").triangles.tolist() == [[0, 1, 2]]


def test_colours_and_weights_after_the_position_are_passed_over() -> None:
    mesh = _parse(b"v 0 0 0 1\nv 1 0 0 0.2 0.3 0.4\nv 0 1 0\nf 1 2 3\n")
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "has no vertices"),
        (b"f 1 2 3\n", "has no vertices"),
        (CORNERS, "has no faces"),
        (CORNERS + b"f 1 2 3 4\n", r"a.obj: line 5: the face has more than three corners; triangulate"),
        (CORNERS + b"f 1 2\n", "line 5: the face has 2 corners; triangulate"),
        (CORNERS + b"f 1 2 0\n", "line 5: '0' is not a corner"),
        (CORNERS + b"f 1 2 x\n", "line 5: 'x' is not a corner"),
        (CORNERS + b"f 1 2 /3\n", "line 5: '/3' is not a corner"),
        (CORNERS + b"f 1 2 1.5\n", "line 5: '1.5' is not a corner"),
        (CORNERS + b"f 1 2 99999999999999999999\n", "is not a corner"),
        (CORNERS + b"f 1 2 " + b"9" * 5000 + b"\n", "is not a corner"),
        (
            CORNERS + b"\nf 1 2 3\nf 1 2 5\n",
            r"line 7: face 1 has corners 1, 2, 5, but there are vertices 1\.\.4",
        ),
        (CORNERS + b"f 1 2 -5\n", "line 5: face 0 has corners"),
        (b"v 0 0\nf 1 1 1\n", "line 1: 'v' needs three numbers, got '0 0'"),
        (b"v 0 0 x\n", "line 1: 'v' needs three numbers"),
        (CORNERS + b"v nan 0 0\nf 1 2 3\n", "vertex 5 is not finite"),
        (CORNERS + b"v 1e39 0 0\nf 1 2 3\n", "vertex 5 is not finite"),
    ],
)
def test_bad_text_is_refused(text: bytes, message: str) -> None:
    with pytest.raises(AvatarError, match=message):
        _parse(text)


def test_one_long_line_takes_little_memory() -> None:
    for word in (b"v", b"f"):
        text = word + b" 1" * 1_000_000
        assert peak_bytes(lambda text=text: only_avatar_errors(lambda: parse_obj([text]))) < 3 * len(text)


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(TEXT)
    assert np.array_equal(read_obj(path).vertices, _parse(TEXT).vertices)
    assert np.array_equal(read_mesh(path).vertices, _parse(TEXT).vertices)
    for wrong, message in (
        (tmp_path / "none.obj", "no such file"),
        (tmp_path, "is not a mesh file that can be read"),
    ):
        with pytest.raises(AvatarError, match=message):
            read_mesh(wrong)


def test_a_large_file_is_refused_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avatar_export.formats.obj.MAX_BYTES", 100)
    path = tmp_path / "a.obj"
    path.write_bytes(TEXT)
    with pytest.raises(AvatarError, match=f"is {len(TEXT)} bytes long; up to 100 are read"):
        read_obj(path)


def test_npz_meshes(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, vertices=splatting_files.VERTICES, faces=splatting_files.FACES.astype("u1"))
    mesh = read_mesh(path)
    assert np.array_equal(mesh.vertices, splatting_files.VERTICES.astype("f4"))
    assert np.array_equal(mesh.triangles, splatting_files.FACES)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((4, 2))}, r"vertices: expected floats \[rows, 3\], got float64\[4, 2\]"),
        ({"vertices": np.zeros((0, 3))}, "vertices: expected floats"),
        ({"vertices": np.full((9, 3), 1e39)}, r"vertices\[0\]: is not finite"),
        ({"faces": np.zeros((4, 3))}, "faces: expected whole numbers"),
        (
            {"faces": np.array([[0, 1, 2], [0, 1, 6]])},
            r"faces\[1\]: is \[0, 1, 6\], but there are 6 vertices",
        ),
        ({"faces": np.array([[0, -1, 2]], "i1")}, r"faces\[0\]: is"),
        ({"faces": np.array([[0, 1, 2**64 - 1]], "u8")}, r"faces\[0\]: is"),
        ({"faces": None}, "needs arrays vertices and faces, but holds vertices"),
    ],
)
def test_bad_npz_meshes_are_refused(change: dict[str, object], message: str, tmp_path: Path) -> None:
    arrays = {"vertices": splatting_files.VERTICES, "faces": splatting_files.FACES, **change}
    path = tmp_path / "a.npz"
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    with pytest.raises(AvatarError, match=message):
        read_mesh(path)


@MANGLING
@given(mangled(TEXT))
def test_mangled_text(data: bytes) -> None:
    only_avatar_errors(lambda: _parse(data))


WORDS = st.sampled_from(
    [b"v", b"f", b"vn", b"vt", b"1", b"-1", b"0", b"2//2", b"3/1/1", b"1/", b"//", b"nan", b"inf", b"-inf", b"1e400",
     b"1_0", b"0x1", b"+2", b"\xff", b"\0", b"#", b"\\", b"2147483648", b"-9223372036854775808"]
)  # fmt: skip


@MANGLING
@given(st.lists(st.lists(WORDS, max_size=6).map(b" ".join), max_size=12))
def test_any_words(lines: list[bytes]) -> None:
    only_avatar_errors(lambda: parse_obj([CORNERS, *lines]))
    only_avatar_errors(lambda: _parse(CORNERS + b"\n".join(lines)))
