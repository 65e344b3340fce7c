"""Packed avatars play on every backend within the tolerances of unpacked ones; every codec and rule is covered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from avatar_export.packing.quantise import quantised
from avatar_export.packing.reference import (
    conform_pack_driving,
    read_pack_reference,
    reference_of,
    write_folder,
)
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar, Packed
from avatar_runtime.backends.gl.context import own_context
from avatar_runtime.conformance import conform
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.program.bake import bake
from tests.avatars import full_avatar
from tests.exporter.packing.cases import AVATARS, COARSE, levels_of
from tests.measured import Measure
from tests.runtime.backends import gl_cases

LIMIT = 128 << 20
WIDE = Fineness(0.02)  # so fine that positions and deltas take 16 bits
FINENESS = {"8 bits": COARSE, "16 bits": WIDE}
PLAYED = [
    *((name, "8 bits") for name in gl_cases.avatars()),
    ("full", "16 bits"),
    ("surface world", "16 bits"),
]


@pytest.fixture(scope="module")
def context() -> Iterator[moderngl.Context]:
    made = own_context(es=False)
    yield made
    made.release()


def coded(avatar: Avatar, fine: Fineness, limit: int = LIMIT) -> Avatar:
    """The avatar that a pack of it plays, with its program."""
    stored, codes = quantised(avatar, fine)
    return replace(stored, packed=Packed.of(stored, bake(stored, codes, limit), 0, 1, lambda _: stored))


def widths(avatar: Avatar) -> set[object]:
    assert avatar.packed is not None
    passes = avatar.packed.program.passes()
    return {value for one in passes for name, value in one.constants.items() if name.endswith("_width")}


@pytest.mark.parametrize(("name", "bits"), PLAYED)
def test_stages_on_the_gpu_read_small_integers(
    name: str, bits: str, context: moderngl.Context, measured: Measure
) -> None:
    """Against the reference, which plays the decoded floats: the tolerances of unpacked avatars."""
    avatar = coded(gl_cases.avatars()[name], FINENESS[bits])
    assert {0, 8, 16, 32} >= widths(avatar) and (16 if bits == "16 bits" else 8) in widths(avatar)
    seen = gl_cases.camera()
    with gl_cases.backend(avatar, context=context) as gl:
        assert gl.interpreter.program is avatar.packed.program
        for stage, (inputs, outputs) in gl_cases.stage_inputs(avatar, seen).items():
            gl_cases.check_stage(stage, gl.stage(stage, inputs, seen, "engine"), outputs, measured)


def test_levels_play_alone_and_by_the_player(context: moderngl.Context) -> None:
    for avatar in AVATARS.values():
        fine = decode_pack(pack(levels_of(avatar), COARSE).file, "x").avatar
        pose, seen = gl_cases.pose_of(fine), gl_cases.camera()
        for level in (0, 1):
            cpu = Player(fine, "reference", level=level).frame(pose, seen, (0, 0, 0), "engine").image
            player = Player(fine, "gl", level=level, context=context)
            assert np.abs(player.frame(pose, seen, (0, 0, 0)).image.colour - cpu.colour).max() <= 1 / 255
            assert player.backend.interpreter.level.rows == player.avatar.gaussians.count
        with pytest.raises(AvatarError, match="the last one is level 1"):
            Player(fine, "reference", level=2)
    with pytest.raises(AvatarError, match="the last one is level 0"):
        Player(full_avatar(3), "reference", level=1)


@pytest.mark.parametrize("name", AVATARS)
def test_a_packs_reference_is_repeated_by_every_backend(name: str, tmp_path: Path) -> None:
    made = pack([AVATARS[name]], COARSE)
    path = tmp_path / "x.avatar"
    path.write_bytes(made.file)
    write_folder(tmp_path / "x.reference", reference_of(made.avatar, "right", made.file), force=False)
    avatar, reference = decode_pack(made.file, "x").avatar, read_pack_reference(path)
    for backend in ("reference", "cpu", "gl"):
        report = conform(avatar, reference, backend)
        assert report.passed, (backend, report.first_failure)
    driving = conform_pack_driving(path, avatar)
    assert driving is None or driving.passed
    mini = decode_pack((tmp_path / "x.reference" / "mini.avatar").read_bytes(), "mini").avatar
    assert mini.gaussians.count == len(reference.rows)
    np.testing.assert_array_equal(mini.gaussians.sh, avatar.gaussians.sh[reference.rows])
    assert widths(mini) == widths(avatar)


def test_a_reference_of_another_pack_is_refused(tmp_path: Path) -> None:
    made, path = pack([AVATARS["joints"]], COARSE), tmp_path / "x.avatar"
    path.write_bytes(made.file)
    with pytest.raises(AvatarError, match="`pack --reference` writes it"):
        read_pack_reference(path)
    write_folder(tmp_path / "x.reference", reference_of(made.avatar, "right", made.file), force=False)
    path.write_bytes(pack([AVATARS["joints"]], None).file)
    with pytest.raises(AvatarError, match=r"was made for another x\.avatar"):
        read_pack_reference(path)
