"""The trained avatars that are shipped: sound, small, and drawn as their trainer drew them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from samples.trained import RECIPES

from avatar_export.checks.bundle import validate
from avatar_export.checks.reference import read_reference
from avatar_export.images import arkit_pose
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.conformance import conform
from avatar_runtime.player import Player

TRAINED = Path(__file__).parents[2] / "samples" / "trained"
NORMATIVE_MB, ALL_MB = 12, 36


def megabytes(folder: Path, *, derived: bool) -> float:
    files = json.loads((folder / "avatar.json").read_text("utf-8"))["files"]
    return sum(entry["bytes"] for entry in files if derived or not entry["derived"]) / 1e6


def test_every_recipe_is_shipped_and_small() -> None:
    assert {path.name for path in TRAINED.iterdir() if path.is_dir()} == set(RECIPES)
    for name in RECIPES:
        assert megabytes(TRAINED / name, derived=False) < NORMATIVE_MB
    assert sum(megabytes(TRAINED / name, derived=True) for name in RECIPES) < ALL_MB


@pytest.mark.parametrize("name", RECIPES)
def test_is_sound_and_says_whence_it_comes(name: str) -> None:
    assert [str(problem) for problem in validate(TRAINED / name) if not problem.warning] == []
    provenance = load(TRAINED / name).provenance
    assert provenance["licence"]
    assert provenance["trained"]["capture"].startswith("synthetic")


@pytest.mark.parametrize("backend", ["cpu", "gl"])  # `validate` asks backend `reference`
@pytest.mark.parametrize("name", RECIPES)
def test_every_backend_repeats_the_trainers_reference(name: str, backend: str) -> None:
    read = opener(TRAINED / name)
    reference = read_reference(read_manifest(read), read)
    assert reference.made_by == "trainer"
    report = conform(load(TRAINED / name), reference, backend)
    assert [row for row in report.rows if not row.passed] == []
    assert [row for row in report.images if not row.passed] == []


def front(avatar: Avatar) -> Camera:
    low, high = avatar.gaussians.mean.min(axis=0), avatar.gaussians.mean.max(axis=0)
    return Camera.orbit((low + high) / 2, 2.2 * float((high - low).max()), 0.0, 0.0, 0.45, 96, 96)


@pytest.mark.parametrize("name", RECIPES)
def test_moves(name: str) -> None:
    """The clips play, and their frames differ."""
    avatar = load(TRAINED / name)
    assert [clip.name for clip in avatar.clips][:2] == ["held_out", "training"]
    player, camera = Player(avatar, "reference"), front(avatar)
    clip = avatar.clips[0]
    first, later = (
        player.frame(frame_pose(avatar, clip, frame), camera, (0, 0, 0)).image
        for frame in (0, clip.frames // 2)
    )
    assert (first.transmittance < 0.5).mean() > 0.03
    assert np.abs(first.colour - later.colour).max() > 0.2


@pytest.mark.parametrize("name", ["head_blendshapes", "head_splatting"])
def test_the_mouth_opens_dark_and_the_eyes_shut(name: str) -> None:
    """Where the still face has lips and eyes, the open mouth is darker and the lids have the colour of skin."""
    avatar = load(TRAINED / name)
    player = Player(avatar, "reference")
    face = Camera.orbit(np.array([0.0, 0.0, 0.09]), 0.7, 0.0, 0.0, 0.3, 128, 128)

    def drawn(**weights: float) -> np.ndarray:
        return player.frame(arkit_pose(avatar, weights), face, (0, 0, 0)).image.colour

    still, wide, shut = drawn(), drawn(jawOpen=1.0), drawn(eyeBlinkLeft=1.0, eyeBlinkRight=1.0)
    darker = (still - wide).mean(axis=-1)
    assert darker[70:110, 48:80].max() > 0.25
    changed = np.abs(still - shut).max(axis=-1) > 0.1
    rows = np.flatnonzero(changed.any(axis=1))
    assert len(np.flatnonzero(changed)) > 20
    assert rows.max() < 70  # nothing below the nose


@pytest.mark.parametrize("name", ["head_blendshapes", "head_splatting"])
def test_closed_lids_cover_the_eyes_close_up(name: str) -> None:
    """Lids have the colour of skin, more red than blue; eyes are white, blue, black. Larger than in training."""
    avatar = load(TRAINED / name)
    player = Player(avatar, "reference")
    eyes = Camera.orbit(np.array([0.0, 0.036, 0.09]), 0.7, 0.0, 0.0, 0.13, 128, 128)

    def drawn(**weights: float) -> np.ndarray:
        return player.frame(arkit_pose(avatar, weights), eyes, (0, 0, 0)).image.colour

    still, shut = drawn(), drawn(eyeBlinkLeft=1.0, eyeBlinkRight=1.0)
    lids = np.abs(still - shut).max(axis=-1) > 0.1
    assert lids.sum() > 500
    assert (shut[lids, 0] - shut[lids, 2]).min() > 0.1
