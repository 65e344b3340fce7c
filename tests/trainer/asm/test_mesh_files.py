"""Scans from files of any common format: what is read, what is refused in one line, and that nothing else is opened."""

from __future__ import annotations

import json
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.asm import mesh_files
from avatar_trainer.asm.mesh_files import FORMATS, read_points, read_topology
from tests.hostile import MANGLING, mangled, only_avatar_errors

POINTS = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.2, 0], [0, 0.2, 0.05], [0.3, 0.3, 0.3]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [4, 2, 1]])


def exported(suffix: str) -> bytes:
    mesh = trimesh.Trimesh(POINTS, TRIANGLES, process=False)
    data = mesh.export(file_type=suffix[1:])
    return data.encode() if isinstance(data, str) else bytes(data)


def written(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def corners(points: Any, triangles: Any) -> Any:
    assert triangles is not None
    return points[triangles]


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_gives_the_same_triangles(suffix: str, tmp_path: Path) -> None:
    path = written(tmp_path, f"scan{suffix.upper()}", exported(suffix))
    points, triangles = read_points(path)
    np.testing.assert_allclose(corners(points, triangles), POINTS[TRIANGLES], atol=1e-7)
    if suffix != ".stl":  # which has no shared vertices
        np.testing.assert_allclose(points, POINTS, atol=1e-7)
    again, _ = read_topology(path)
    np.testing.assert_allclose(again, points, atol=1e-7)


def test_a_scene_is_one_scan_where_its_nodes_put_it(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    moved = np.eye(4)
    moved[:3, 3] = 1, 2, 3
    scene.add_geometry(trimesh.Trimesh(POINTS[:3], [[0, 1, 2]], process=False), node_name="a")
    scene.add_geometry(
        trimesh.Trimesh(POINTS[:3], [[2, 1, 0]], process=False), node_name="b", transform=moved
    )
    points, triangles = read_points(written(tmp_path, "two.glb", scene.export(file_type="glb")))
    places = sorted(corners(points, triangles).sum(axis=(1, 2)).round(5).tolist())
    own = float(POINTS[:3].sum())
    assert places == pytest.approx([own, own + 18], abs=1e-5)


CASES: dict[str, tuple[str, bytes, str]] = {
    "no points": ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n", "a.ply"),
    "a huge count": ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 9000000000000\nend_header\n", "claims 9000"),
    "another huge count": ("a.off", b"OFF\n2000000000 0 0\n", "claims 2000000000"),
    "an archive": ("a.3mf", b"PK", "is not a scan format"),
    "a drawing": ("a.xaml", b"<a/>", "is not a scan format"),
    "no number": ("a.obj", b"v 0 0 nan\nv 0 1 0\nv 1 0 0\nf 1 2 3\n", "a.obj"),
    "a point that is not there": ("a.obj", b"v 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 9\n", "a.obj"),
    "empty": ("a.stl", b"", "a.stl"),
    "another format": ("a.ply", exported(".glb"), "a.ply"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_no_scan_is_one_line(case: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    name, data, said = CASES[case]
    path = written(tmp_path, name, data)
    with pytest.raises(AvatarError) as error:
        read_points(path)
    assert said in str(error.value) and "\n" not in str(error.value) and not caplog.records


def glb(document: dict[str, Any], binary: bytes = b"") -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_a_glb_claims_no_more_than_it_holds_and_names_no_other_file(tmp_path: Path) -> None:
    mesh = {"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "asset": {"version": "2.0"}}
    scene = {"scenes": [{"nodes": [0]}], "scene": 0, "nodes": [{"mesh": 0}]}
    huge = {"accessors": [{"count": 10**9, "componentType": 5126, "type": "VEC3"}]}
    with pytest.raises(AvatarError, match="claims 1000000000 elements"):
        read_points(written(tmp_path, "a.glb", glb({**mesh, **scene, **huge}, bytes(64))))
    (tmp_path / "secret.bin").write_bytes(np.zeros(9, np.float32).tobytes())
    outside = {
        "accessors": [{"count": 3, "componentType": 5126, "type": "VEC3", "bufferView": 0}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": "secret.bin", "byteLength": 36}],
    }
    data = glb({**mesh, **scene, **outside})
    with pytest.raises(AvatarError, match=r"b\.glb"):
        read_points(written(tmp_path, "b.glb", data))


def test_without_trimesh_one_line_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(AvatarError, match=r"needs trimesh: pip install -e .*\[train\]"):
        read_points(written(tmp_path, "a.obj", exported(".obj")))
    np.savez(tmp_path / "a.npz", vertices=POINTS, faces=TRIANGLES)
    points, triangles = read_points(tmp_path / "a.npz")
    assert triangles is not None and len(points) == len(POINTS)


def test_too_large_a_file_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, "a.obj", exported(".obj"))
    monkeypatch.setattr(mesh_files, "MAX_BYTES", 10)
    with pytest.raises(AvatarError, match=r"a\.obj"):
        read_points(path)


@pytest.mark.parametrize("suffix", FORMATS)
def test_damaged_scans_are_refused_or_read(suffix: str, tmp_path: Path) -> None:
    @MANGLING
    @given(data=mangled(exported(suffix)))
    def read(data: bytes) -> None:
        only_avatar_errors(lambda: read_points(written(tmp_path, f"scan{suffix}", data)))

    read()
