"""same_glb: what passes for the same file, what does not, and what a stranger's bytes get."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from avatar_export.writers.same_glb import same_glb
from avatar_export.writers.splats_glb import splats_glb
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from tests.avatars import COUNT, full_avatar
from tests.exporter.glb_files import edited
from tests.oracles.gltf_pose import File
from tests.rigs import written
from tests.session.fuzz import examples

NEW = written(full_avatar())


def remade(change: Callable[[dict[str, Any]], None], data: bytes = NEW) -> bytes:
    return edited(data, change)


def test_the_same_bytes_and_the_same_but_for_rounding() -> None:
    assert same_glb(NEW, NEW) is None
    assert same_glb(remade(lambda d: d["asset"].update(generator="avatar-export 99")), NEW) is None
    splats = [b"".join(splats_glb(avatar)) for avatar in (full_avatar(), rounded(full_avatar()))]
    assert splats[0] != splats[1] and same_glb(*splats) is None


def rounded(avatar: Avatar) -> Avatar:
    """The avatar with scales off by what another machine's exp may do."""
    log_scale = np.nextafter(avatar.gaussians.log_scale, np.float32(0))
    return replace(avatar, gaussians=replace(avatar.gaussians, log_scale=log_scale))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["asset"].update(version="2.1"), "asset.version is 2.1, not 2.0"),
        (lambda d: d.pop("animations"), "the document has other keys"),
        (lambda d: d["nodes"].pop(), "nodes has another length"),
        (lambda d: d["nodes"][2]["translation"].__setitem__(0, 1.0), r"nodes\[2\]\.translation\[0\] is 1\.0"),
        (lambda d: d["nodes"][2].update(translation="here"), r"nodes\[2\]\.translation has another length"),
        (
            lambda d: d["nodes"][2]["translation"].__setitem__(0, 10**400),
            r"translation\[0\] is a huge number",
        ),
        (lambda d: d["nodes"][2]["translation"].__setitem__(0, True), r"translation\[0\] is True"),
        (lambda d: d["scenes"][0].update(nodes=[0, 1.0]), r"scenes\[0\]\.nodes\[1\] is 1\.0, not 1"),
        (lambda d: d["meshes"][0].update(extras=None), r"meshes\[0\]\.extras has other keys"),
    ],
)
def test_another_document(change: Callable[[dict[str, Any]], None], said: str) -> None:
    assert re.search(said, str(same_glb(remade(change), NEW)))


@pytest.mark.parametrize(
    ("name", "said"), [("NORMAL", "NORMAL"), ("JOINTS_0", "JOINTS_0"), ("", "indices, skin or animation")]
)
def test_other_values(name: str, said: str) -> None:
    file = File(NEW)
    primitive = file.json["meshes"][0]["primitives"][0]
    index = primitive["attributes"][name] if name else primitive["indices"]
    view = file.json["bufferViews"][file.json["accessors"][index]["bufferView"]]
    data = bytearray(NEW)
    at = len(NEW) - len(file.binary) + view.get("byteOffset", 0)
    data[at + (3 if name == "NORMAL" else 0)] ^= 1
    assert same_glb(bytes(data), NEW) == f"accessors[{index}] ({said}) has other values"


@settings(max_examples=examples(150))
@example([(0, 0)])
@given(st.lists(st.tuples(st.integers(0, len(NEW) - 1), st.integers(0, 255)), min_size=1, max_size=4))
def test_mangled_bytes_differ_or_are_refused(changes: list[tuple[int, int]]) -> None:
    data = bytearray(NEW)
    for at, byte in changes:
        data[at] = byte
    try:
        found = same_glb(bytes(data), NEW, "rig.glb")
    except AvatarError as error:
        found = str(error)
        assert found.startswith("rig.glb: ")
    assert "\n" not in (found or "")


def splats_file(avatar: Avatar) -> File:
    return File(b"".join(splats_glb(avatar)))


def test_the_fallback_colour_is_linear_and_straight() -> None:
    sh = np.zeros((COUNT, 16, 3), np.float32)
    sh[:, 0] = (np.array([0.2, 0.5, 1.5]) - 0.5) / 0.28209479177387814
    avatar = full_avatar()
    grey = replace(avatar.gaussians, sh=sh, opacity_logit=np.zeros(COUNT, np.float32))
    colour = splats_file(replace(avatar, gaussians=grey)).attribute("COLOR_0")
    decoded = [((0.2 + 0.055) / 1.055) ** 2.4, ((0.5 + 0.055) / 1.055) ** 2.4, 1.0, 0.5]
    np.testing.assert_allclose(colour, np.tile(decoded, (COUNT, 1)), atol=0.51 / 255)
