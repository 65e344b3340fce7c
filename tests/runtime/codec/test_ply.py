"""PLY: bit-equal round trips, crossed with plyfile, bad files by name."""

from __future__ import annotations

import io

import numpy as np
import pytest
from plyfile import PlyData, PlyElement

from avatar_runtime.avatar import Gaussians
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from tests.shared_data import shared

FIELDS = ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")


def made(count: int = 5, degree: int = 1) -> Gaussians:
    rng = np.random.default_rng(degree)

    def values(*shape: int) -> np.ndarray:
        return rng.normal(size=(count, *shape)).astype(np.float32)

    return Gaussians(values(3), values(3), values(4), values(), values((degree + 1) ** 2, 3))


def with_plyfile(gaussians: Gaussians, kind: str = "f4", reverse: bool = False) -> bytes:
    """The INRIA layout as another library writes it: f_rest channel-major."""
    g = gaussians
    columns = {f"{axis}": g.mean[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"n{axis}": np.zeros(g.count) for axis in "xyz"}
    columns |= {f"f_dc_{i}": g.sh[:, 0, i] for i in range(3)}
    rest = g.sh[:, 1:].transpose(0, 2, 1).reshape(g.count, -1)
    columns |= {f"f_rest_{i}": rest[:, i] for i in range(rest.shape[1])}
    columns |= {"opacity": g.opacity_logit}
    columns |= {f"scale_{i}": g.log_scale[:, i] for i in range(3)}
    columns |= {f"rot_{i}": g.quat_wxyz[:, i] for i in range(4)}
    names = list(columns)[::-1] if reverse else list(columns)
    rows = np.zeros(g.count, [(name, kind) for name in names])
    for name in names:
        rows[name] = columns[name]
    stream = io.BytesIO()
    element = PlyElement.describe(rows, "vertex")
    PlyData([element], byte_order="<", comments=["SplatRenderMode: default"]).write(stream)
    return stream.getvalue()


def assert_bit_equal(a: Gaussians, b: Gaussians) -> None:
    for field in FIELDS:
        x, y = getattr(a, field), getattr(b, field)
        assert x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes(), field


@pytest.mark.parametrize("degree", range(4))
def test_round_trip(degree: int) -> None:
    g = made(7, degree)
    g.mean[0] = [-0.0, 1e-45, np.finfo(np.float32).max]
    data = ply.encode(g, ["one", "two words"])
    assert data == ply.encode(g, ["one", "two words"])
    decoded = ply.decode(data)
    assert decoded.comments == ("one", "two words") and decoded.count == 7
    assert_bit_equal(ply.gaussians(decoded), g)


@pytest.mark.parametrize("degree", range(4))
def test_same_bytes_as_plyfile(degree: int) -> None:
    g = made(4, degree)
    assert ply.encode(g, ["SplatRenderMode: default"]) == with_plyfile(g)


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_any_order_and_scalar_type(kind: str) -> None:
    g = made(6, 3)
    assert_bit_equal(ply.gaussians(ply.decode(with_plyfile(g, kind, reverse=True))), g)


def test_real_splat_as_plyfile_reads_it() -> None:
    path = shared("splat/playbot_lod3.ply")
    g = ply.gaussians(ply.decode(path.read_bytes(), path.name))
    vertex = PlyData.read(path)["vertex"]
    assert g.sh_degree == 2
    assert np.array_equal(g.quat_wxyz[:, 1], vertex["rot_1"])
    assert np.array_equal(g.sh[:, 3, 1], vertex["f_rest_10"])  # green, third of eight
    again = ply.encode(g)
    assert_bit_equal(ply.gaussians(ply.decode(again)), g)


def test_comments_are_one_line_of_ascii() -> None:
    for comment in ("two\nlines", "end_header\n", "ü"):
        with pytest.raises(ValueError, match="printable ASCII"):
            ply.encode(made(), [comment])


GOOD = ply.encode(made())
HEAD, BODY = GOOD[: GOOD.index(b"end_header")], GOOD[GOOD.index(b"end_header") + len(b"end_header\n") :]


def _header(old: bytes, new: bytes) -> bytes:
    assert old in HEAD
    return HEAD.replace(old, new, 1) + b"end_header\n" + BODY


BAD = {
    "another format": (b"glTF" + GOOD, "does not begin with 'ply'"),
    "ASCII": (_header(b"binary_little_endian", b"ascii"), "got 'format ascii 1.0'"),
    "truncated": (GOOD[:-1], "says 5 rows of 104 bytes, but 519 bytes follow"),
    "junk after the rows": (GOOD + b"\0", "says 5 rows of 104 bytes, but 521 bytes follow"),
    "absurd count": (_header(b"vertex 5", b"vertex 999999999999999999"), "says 999999999999999999 rows"),
    "negative count": (_header(b"vertex 5", b"vertex -5"), "is not a name and a count"),
    "no rows": (HEAD.replace(b"vertex 5", b"vertex 0") + b"end_header\n", "vertex: has no rows"),
    "list": (_header(b"property float x\n", b"property list uchar int x\n"), "is a list"),
    "unknown type": (_header(b"property float x\n", b"property half x\n"), "is not a scalar type and a name"),
    "property twice": (_header(b"property float ny\n", b"property float nx\n"), "nx: is a duplicate"),
    "element twice": (_header(b"element vertex 5\n", b"element vertex 5\nelement vertex 5\n"), "duplicate"),
    "faces": (_header(b"element vertex 5\n", b"element face 2\nelement vertex 5\n"), "element face: has 2"),
    "other element": (_header(b"element vertex 5", b"element point 0"), "no element 'vertex' with"),
    "no format": (b"ply\nelement vertex 9\nend_header\n", "got 'element vertex 9'"),
    "nothing in the header": (b"ply\nend_header\n", "got 'nothing'"),
    "stray line": (_header(b"property float x\n", b"properly float x\n"), "is not PLY"),
    "header without end": (HEAD + BODY, "has no end_header within 65536 bytes"),
    "end too late": (
        _header(b"element vertex", b"comment " + b"a" * 65536 + b"\nelement vertex"),
        "no end_header",
    ),
    "missing property": (_header(b"float rot_2\n", b"float rot_9\n"), "property rot_2: is missing"),
    "f_rest of no degree": (_header(b"float f_rest_3\n", b"float f_dest_3\n"), "f_rest_*: 8 properties"),
    "NaN": (GOOD[:-2] + b"\xff\xff", "rot_3[4]: is nan"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_named(case: str) -> None:
    data, message = BAD[case]
    with pytest.raises(AvatarError) as caught:
        ply.gaussians(ply.decode(data, "a.ply"), "a.ply")
    assert str(caught.value).startswith("a.ply: ") and message in str(caught.value)
    assert "\n" not in str(caught.value)
