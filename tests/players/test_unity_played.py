"""The Unity player's core plays whole frames and all stages: what it says runs on parts of backend `gl`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.packing.write import prepare, write
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.backends.gl import make_scene
from avatar_runtime.backends.gl.backend import GlBackend
from avatar_runtime.camera import Camera
from avatar_runtime.handedness import mirrored, mirrored_pose
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import full_avatar
from tests.exporter.packing.cases import COARSE
from tests.measured import Measure
from tests.players.played_cases import HEAD, PlayedCase, played_cases
from tests.players.unity_play.desk import Played, play, player_program
from tests.players.unity_play.frames import ROUNDING, frame_of
from tests.players.vectors.light_cases import said_of
from tests.players.vectors.lit_images import LIGHTS, apart, packed_avatars, wanted
from tests.players.web import shot
from tests.runtime.backends import gl_cases

# An image sums some hundred products of float32 whose factors differ by the roundings of the frame's constants.
IMAGE_ROUNDINGS = 64
# The place of an instance is multiplied with the camera, that of a pose with the Gaussians: the one rounds otherwise.
PLACED_ROUNDINGS = 256
STILL = np.eye(4)
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
AGAIN = ("full", "surface world")  # whose expressions change SH, or leave them alone
LIT = ("lit_head", "lit_world")  # of the kit
TWO = ("full", "surface world")  # one that is skinned, and one on a mesh


def scene(
    name: str,
    avatars: list[tuple[Path, Avatar, Pose, F64]],
    camera: Camera,
    level: int = 0,
    twice: bool = False,
) -> dict[str, Any]:
    """A scene for C#: packs with their poses and places. `twice`: it is drawn at rest first."""
    made = shot(name, [(str(file), avatar, pose) for file, avatar, pose, _ in avatars], camera, level)
    for said, (*_, place) in zip(made["avatars"], avatars, strict=True):
        said |= {"place": place.ravel().tolist(), "twice": twice}
    return made


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, PlayedCase]:
    """Avatars under every rule."""
    return played_cases(tmp_path_factory)


@pytest.fixture(scope="module")
def both_frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Packs of one avatar in the right-handed and in the left-handed frame, with two levels."""
    folder, full = tmp_path_factory.mktemp("unity_both"), full_avatar(3)
    for name, avatar in (("right", full), ("left", mirrored(full))):
        (folder / name).write_bytes(write(prepare([avatar, avatar], COARSE), handedness=name).file)
    return folder


def in_frame(folder: Path, handedness: str) -> tuple[Avatar, Pose]:
    """The avatar of a pack of `both_frames`, and one pose in its frame."""
    pose = gl_cases.pose_of(full_avatar(3))
    avatar = decode_pack((folder / handedness).read_bytes(), handedness).avatar
    return avatar, mirrored_pose(pose) if handedness == "left" else pose


@pytest.fixture(scope="module")
def played(
    cases: Mapping[str, PlayedCase], both_frames: Path, kit: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Played]:
    """Everything, played by one process of C#, because mono starts slowly."""
    camera, scenes = gl_cases.camera(), []
    for name, case in cases.items():
        shown = [(case.folder / HEAD, case.avatar, gl_cases.pose_of(case.avatar), STILL)]
        scenes.append(scene(name, shown, camera))
        if name in AGAIN:
            scenes.append(scene(f"{name} again", shown, camera, twice=True))
    pair = [cases[name] for name in TWO]
    placed = [
        (c.folder / HEAD, c.avatar, gl_cases.pose_of(c.avatar), place)
        for c, place in zip(pair, places(), strict=True)
    ]
    scenes.append(scene("two avatars", placed, camera))
    for name in ("right", "left"):
        scenes.append(scene(name, [(both_frames / name, *in_frame(both_frames, name), MIRROR)], camera, 1))
    lit = tmp_path_factory.mktemp("unity_lit")
    for name, (file, _) in packed_avatars().items():
        (lit / name).write_bytes(file)
        avatar = decode_pack(file, name).avatar  # arrays of a pose are in the pack's frame
        for said, light in LIGHTS.items():
            scenes.append(
                scene(f"{name} in {said}", [(lit / name, avatar, gl_cases.pose_of(avatar), STILL)], camera)
            )
            scenes[-1]["avatars"][0]["light"] = said_of(light)
    references = [str(case.folder) for case in cases.values()] + [str(kit / name) for name in LIT]
    job = {"scenes": scenes, "references": references}
    return play(player_program(tmp_path_factory), job, tmp_path_factory.mktemp("unity_played"))


def places() -> list[F64]:
    """Where two avatars stand that hide parts of each other."""
    turns = matrix_from_rotvec(np.array([[0.1, 0.4, -0.2], [0.0, -0.3, 0.1]]))
    return list(homogeneous(turns, np.array([[0.05, 0.0, 0.02], [-0.06, 0.03, -0.05]])))


def off(played: Played, want: F32, roundings: int) -> float:
    """The largest difference of an image, as a share of what it may be."""
    assert played.image is not None and want[..., 3].max() > 0.5
    return float(np.abs(played.image - want).max()) / (roundings * ROUNDING)


def test_frames_are_those_of_backend_gl(
    played: Mapping[str, Played], cases: Mapping[str, PlayedCase], measured: Measure
) -> None:
    """Also the second frame of an avatar, which needs no SH that last."""
    images, lasting = 0.0, {}
    for name, case in cases.items():
        want = frame_of(case.avatar, gl_cases.pose_of(case.avatar), gl_cases.camera()).image
        images = max(images, off(played[name], want, IMAGE_ROUNDINGS))
        if name in AGAIN:
            again = played[f"{name} again"]
            images = max(images, off(again, want, IMAGE_ROUNDINGS))
            terms = [run["constants"]["sh_terms"] for run in again.runs if run["entry"] == "blend"]
            lasting[name] = terms[-1] != terms[0] and terms[-1] == [0]
    measured("unity core, image, share of the tolerance", images, 1)
    assert images <= 1
    assert set(lasting.values()) == {False, True}, lasting


def test_all_stages_repeat_their_references(
    played: Mapping[str, Played], cases: Mapping[str, PlayedCase], measured: Measure
) -> None:
    used = 0.0
    for name, case in cases.items():
        rows = played[str(case.folder)].rows
        stages = {row["stage"] for row in rows}
        assert {"blend", "bind", "activate", "project", "sort", "raster"} <= stages, name
        rig = case.avatar.rig
        assert rig is None or {"driving", "joints"} <= stages, name
        assert rig is None or not len(rig.vertices) or {"morph", "skin"} <= stages, name
        assert not [row for row in rows if not row["passed"]], name
        used = max(used, *(row["used"] for row in rows))
    measured("unity core, stages, share of the tolerance", used, 1)


def test_lit_avatars_are_those_of_backend_gl(played: Mapping[str, Played], measured: Measure) -> None:
    for name, (file, hand) in packed_avatars().items():
        for said, light in LIGHTS.items():
            image = played[f"{name} in {said}"].image
            assert image is not None
            used = apart(image, wanted(file, hand, light), light.shadow)
            measured(f"unity core, lit{' with a shadow' * light.shadow}, share of the tolerance", used, 1)
            assert used <= 1, (name, said)


def test_stages_of_light_repeat_their_references(played: Mapping[str, Played], kit: Path) -> None:
    rows = [row for name in LIT for row in played[str(kit / name)].rows]
    assert {"shadow", "light"} <= {row["stage"] for row in rows}
    assert not [row for row in rows if not row["passed"]]


def test_two_avatars_are_sorted_together(
    played: Mapping[str, Played], cases: Mapping[str, PlayedCase], measured: Measure
) -> None:
    """The place of an instance is the movement of its pose, which comes before it."""
    backends: list[GlBackend] = []
    moved = []
    for name, place in zip(TWO, places(), strict=True):
        avatar, shared = cases[name].avatar, {"context": backends[0].context} if backends else {}
        backends.append(GlBackend(avatar, **shared, target="rgba32f"))
        pose = gl_cases.pose_of(avatar)
        world = place @ np.asarray(pose.world_from_avatar)
        moved.append(Player(avatar, "reference").posed(replace(pose, world_from_avatar=world)))
    image = make_scene(backends).image(moved, gl_cases.camera())
    want = np.dstack([image.colour, 1 - image.transmittance])
    found = off(played["two avatars"], want, PLACED_ROUNDINGS)
    backends[0].release()
    measured("unity core, image of two avatars, share of the tolerance", found, 1)
    assert found <= 1


def test_packs_of_both_hands_are_played(played: Mapping[str, Played], both_frames: Path) -> None:
    """The left-handed one at its coarser level; the right-handed one through a mirror.

    Unity's frame is left-handed: the place of every pack has diag(-1, 1, 1) in it.
    """
    want = frame_of(*in_frame(both_frames, "left"), gl_cases.camera(), level=1).image
    assert off(played["left"], want, IMAGE_ROUNDINGS) <= 1
    avatar, pose = in_frame(both_frames, "right")
    want = frame_of(mirrored(replace(avatar, packed=None)), mirrored_pose(pose), gl_cases.camera()).image
    assert off(played["right"], want, PLACED_ROUNDINGS) <= 1
