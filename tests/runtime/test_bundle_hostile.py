"""No bytes, however mangled, give `load` anything but an avatar or an AvatarError."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from avatar_runtime.bundle import load
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.hostile import mangled, only_avatar_errors
from tests.session.fuzz import examples

MANY = settings(max_examples=examples(120), suppress_health_check=[HealthCheck.too_slow], database=None)
AVATARS = {"skin": full_avatar, "surface": surface_avatar}
ARRAYS = [  # kind of avatar, file
    ("skin", "gaussians.ply"),
    ("skin", "blendshapes.safetensors"),
    ("skin", "rig.safetensors"),
    ("surface", "embedding.safetensors"),
    ("surface", "clips.safetensors"),
]


@pytest.fixture(scope="module", params=AVATARS)
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bundle") / "good"
    return bundles.write(folder, AVATARS[request.param]())


@pytest.fixture(scope="module")
def scratch(good: Path) -> Path:
    """A copy that every example overwrites; names that no example writes stay sound."""
    return Path(shutil.copytree(good, good.with_name("scratch")))


def played(data: bytes, write: Callable[[bytes], Path]) -> None:
    """Loads what `write` makes of many wounds of `data`."""

    @MANY
    @given(mangled(data))
    def check(wounded: bytes) -> None:
        path = write(wounded)
        only_avatar_errors(lambda: load(path))

    check()


@pytest.mark.parametrize(("good", "name"), ARRAYS, indirect=["good"])
@pytest.mark.parametrize("part", ["header", "body"])
def test_mangled_arrays(good: Path, scratch: Path, name: str, part: str) -> None:
    """Wounds of the header hit structure, those behind it only numbers."""
    data = (good / name).read_bytes()
    ply = name.endswith(".ply")
    border = data.index(b"end_header\n") + 11 if ply else 8 + int.from_bytes(data[:8], "little")
    head, body = data[:border], data[border:]

    def write(wounded: bytes) -> Path:
        (scratch / name).write_bytes(wounded + body if part == "header" else head + wounded)
        bundles.save(scratch, bundles.manifest(good))
        bundles.sign(scratch)
        return scratch

    played(head if part == "header" else body, write)
    (scratch / name).write_bytes(data)


def _written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


def places(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of every value in a JSON document."""
    pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [path] * bool(path) + [deep for key, child in pairs for deep in places(child, (*path, key))]


NAMES = ["face", "neck", "jawOpen", "gaussians.ply", "skin", "none", "matrix"]
JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(1 << 70), 1 << 70)
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from([*NAMES, 0, 1, -1, 48, 1e300, 1.0, 10**400]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=6,
)


def test_manifest_values_of_any_kind(good: Path, scratch: Path) -> None:
    document = bundles.manifest(good)

    @settings(MANY, max_examples=examples(250))
    @given(st.lists(st.tuples(st.sampled_from(places(document)), JSON), min_size=1, max_size=2))
    def check(changes: list[tuple[tuple[Any, ...], Any]]) -> None:
        changed = json.loads(json.dumps(document))
        for path, value in changes:
            _replace(changed, path, value)
        (scratch / "avatar.json").write_text(json.dumps(changed), "utf-8")
        only_avatar_errors(lambda: load(scratch))

    check()


def _replace(node: Any, path: tuple[Any, ...], value: Any) -> None:
    try:
        for key in path[:-1]:
            node = node[key]
        node[path[-1]] = value
    except (LookupError, TypeError):
        pass  # an earlier change took this place away
