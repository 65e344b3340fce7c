"""No bytes, however mangled, give `load` anything but an avatar or an AvatarError."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from avatar_runtime.bundle import load
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.session.fuzz import examples

MANY = settings(max_examples=examples(120), suppress_health_check=[HealthCheck.too_slow])


AVATARS = {"skin": full_avatar, "surface": surface_avatar}


@pytest.fixture(scope="module", params=AVATARS)
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bundle") / "good"
    return bundles.write(folder, AVATARS[request.param]())


@pytest.fixture(scope="module")
def scratch(good: Path) -> Path:
    """A copy that every example overwrites; names that no example writes stay sound."""
    return Path(shutil.copytree(good, good.with_name("scratch")))


def loads_or_refuses(path: Path) -> bool:
    try:
        load(path)
    except AvatarError as error:
        assert "\n" not in str(error)
        return False
    return True


# (where, how many bytes go, what comes), a few times: flips, insertions, deletions, cuts.
EDITS = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 8) | st.just(1 << 30), st.binary(max_size=8)),
    min_size=1,
    max_size=4,
)


def mangled(
    data: bytes, edits: list[tuple[float, int, bytes]], first: int = 0, last: int | None = None
) -> bytes:
    """`data` with the edits at fractions of the range first..last."""
    out = bytearray(data)
    for where, gone, come in edits:
        at = first + int(where * ((len(data) if last is None else last) - first))
        out[at : at + gone] = come
    return bytes(out)


def headers(name: str, data: bytes) -> int:
    """Where the header ends: edits there hit structure, edits behind it only numbers."""
    return (
        data.index(b"end_header\n") + 11 if name.endswith(".ply") else 8 + int.from_bytes(data[:8], "little")
    )


ARRAYS = [  # kind of avatar, file
    ("skin", "gaussians.ply"),
    ("skin", "blendshapes.safetensors"),
    ("skin", "rig.safetensors"),
    ("surface", "embedding.safetensors"),
    ("surface", "clips.safetensors"),
]


@pytest.mark.parametrize(("good", "name"), ARRAYS, indirect=["good"])
@pytest.mark.parametrize("part", ["header", "body"])
def test_mangled_arrays(good: Path, scratch: Path, name: str, part: str) -> None:
    data = (good / name).read_bytes()
    border = headers(name, data)

    @MANY
    @given(EDITS)
    def check(edits: list[tuple[float, int, bytes]]) -> None:
        span = (0, border) if part == "header" else (border, len(data))
        (scratch / name).write_bytes(mangled(data, edits, *span))
        bundles.save(scratch, bundles.manifest(good))
        bundles.sign(scratch)
        loads_or_refuses(scratch)

    check()
    (scratch / name).write_bytes(data)


def test_mangled_manifest_bytes(good: Path, scratch: Path) -> None:
    data = (good / "avatar.json").read_bytes()

    @MANY
    @given(EDITS)
    def check(edits: list[tuple[float, int, bytes]]) -> None:
        (scratch / "avatar.json").write_bytes(mangled(data, edits))
        loads_or_refuses(scratch)

    check()


def places(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of every value in a JSON document."""
    inner: list[tuple[Any, Any]] = []
    if isinstance(node, dict):
        inner = list(node.items())
    elif isinstance(node, list):
        inner = list(enumerate(node))
    return [path] * bool(path) + [deep for key, child in inner for deep in places(child, (*path, key))]


JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(1 << 70), 1 << 70)
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(
        [
            "face",
            "neck",
            "jawOpen",
            "gaussians.ply",
            "skin",
            "none",
            "matrix",
            0,
            1,
            -1,
            48,
            1e300,
            1.0,
            10**400,
        ]
    ),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)


def test_manifest_values_of_any_kind(good: Path, scratch: Path) -> None:
    document = bundles.manifest(good)
    paths = places(document)
    outcomes = set()

    @settings(MANY, max_examples=examples(250))
    @given(st.lists(st.tuples(st.sampled_from(paths), JSON), min_size=1, max_size=2))
    @example([(("name",), "another")])  # a change that is no fault
    def check(changes: list[tuple[tuple[Any, ...], Any]]) -> None:
        changed = json.loads(json.dumps(document))
        for path, value in changes:
            _replace(changed, path, value)
        (scratch / "avatar.json").write_text(json.dumps(changed), "utf-8")
        outcomes.add(loads_or_refuses(scratch))

    check()
    assert outcomes == {True, False}


def _replace(node: Any, path: tuple[Any, ...], value: Any) -> None:
    try:
        for key in path[:-1]:
            node = node[key]
        node[path[-1]] = value
    except (LookupError, TypeError):
        pass  # an earlier change took this place away


def test_mangled_zips(good: Path, scratch: Path) -> None:
    packed = good.with_name("packed.zip")
    data = bundles.zipped(good, packed).read_bytes()
    directory = data.index(b"PK\x01\x02")  # names, sizes and offsets stand at the end
    target = good.with_name("mangled.zip")

    def check(first: int) -> Callable[[], None]:
        @MANY
        @given(EDITS)
        def mangle(edits: list[tuple[float, int, bytes]]) -> None:
            target.write_bytes(mangled(data, edits, first))
            loads_or_refuses(target)

        return mangle

    check(0)()
    check(directory)()


LINES = st.sampled_from(
    [
        "element vertex 2",
        "element vertex 0",
        "element vertex 99999999999999999",
        "element vertex -1",
        "element face 0",
        "element face 3",
        "property float x",
        "property double y",
        "property uchar z",
        "property list uchar int vertex_indices",
        "property float \x00",
        "property float",
        "comment x",
        "obj_info x",
        "end_header",
        "format ascii 1.0",
        "",
    ]
    + [f"property float {name}" for name in (*ply.POSITION, *ply.DC, *ply.OPACITY, *ply.SCALE, *ply.ROTATION)]
)


@MANY
@given(st.lists(LINES, max_size=24), st.integers(0, 200), st.sampled_from(["\n", "\r\n"]))
def test_ply_headers_of_any_lines(lines: list[str], size: int, end: str) -> None:
    text = end.join(["ply", "format binary_little_endian 1.0", *lines, "end_header", ""])
    try:
        ply.gaussians(ply.decode(text.encode() + bytes(size), "x"), "x")
    except AvatarError as error:
        assert "\n" not in str(error)
