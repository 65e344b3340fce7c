"""From training to a bundle and back: what is exported gives the trainer's image, by files alone."""

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from samples.capture.body import write_body
from samples.capture.head import write_head
from samples.capture.shots import Noise

from avatar_export.checks.bundle import validate
from avatar_export.checks.reference import read_reference
from avatar_export.provenance import BODY_LICENCE
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.conformance import conform, images
from avatar_runtime.conformance.run import COLOUR_STEPS
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.bundles.export import clips, export, image
from avatar_trainer.captures.load import load as load_capture
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.compare import compare, playable
from avatar_trainer.head import HEAD_LICENCE, head_for
from avatar_trainer.head import write_body as head_files
from avatar_trainer.loop.run import UPSTREAM
from avatar_trainer.loop.train import train
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.protocol import System
from avatar_trainer.systems.table import system_module

Measured = Callable[[str, float], None]
PAPER = {"scale": "linear_area", "position": "interpolated_normal", "rotation": "vertex_quaternion_mean"}
PAPER_BLENDSHAPES = {"mask": "per_blendshape", "init_position": "rotation", "init_sh": "rotated"}
PAPER_BLENDSHAPES |= {"anchor": "unique", "lower_teeth": "jaw"}
CASES = {
    "blendshapes": ("head", "gaussian_blendshapes", {}, 1),
    "blendshapes by paper and unique anchors": ("head", "gaussian_blendshapes", PAPER_BLENDSHAPES, 1),
    "splatting": ("head", "splatting_avatar", {}, 1),
    "splatting by paper": ("head", "splatting_avatar", PAPER, 0),
    "body": ("body", "splatting_avatar", {}, 0),
    "head of identity modes": ("modes", "gaussian_blendshapes", {}, 0),
    "points on and off the mesh": ("head", "psavatar", {}, 1),
}
SIZE = 48  # pixels a side
# One of each system: rules and captures change what is drawn, which `compare` sees; not how it is drawn.
DRAWN_BY_DEFINITION = ("blendshapes", "splatting", "points on and off the mesh")


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Capture]:
    folder = tmp_path_factory.mktemp("captures")
    write_head(folder / "head", SIZE, 10, Noise(0.0, 0.0, 0), (), np.radians(40.0))
    write_body(folder / "body", SIZE, 10, Noise(0.0, 0.0, 0))
    shutil.copytree(folder / "head", folder / "modes")
    head_files(head_for(np.random.default_rng(0).normal(size=20)), folder / "modes" / "body")
    return {name: load_capture(folder / name) for name in ("head", "body", "modes")}


def trained(capture: Capture, name: str, rules: dict[str, str], sh_degree: int, out: Path) -> System:
    """A model after a few steps, every parameter of which has moved."""
    module = system_module(name)
    plain = module.Settings()
    settings = replace(
        plain, iterations=12, gaussians=300, sh_degree=sh_degree, rules={**plain.rules, **rules}
    )
    system = module.create(capture, settings, 1)
    run = TrainSettings(iterations=12, seed=1, evaluate_every=0, checkpoint_every=12, refine="on")
    train(system, capture, run, out, system_settings=settings)
    return system


@pytest.fixture(scope="module")
def exported(
    captures: dict[str, Capture], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], tuple[System, Path]]:
    """A case -> the trained model and its bundle; tests must not change them."""

    @cache
    def made(case: str) -> tuple[System, Path]:
        subject, name, rules, degree = CASES[case]
        folder = tmp_path_factory.mktemp("exported")
        system = trained(captures[subject], name, rules, degree, folder / "run")
        export(system, folder / "run" / UPSTREAM, folder / "bundle", engine_files=False, preview=False)
        return system, folder / "bundle"

    return made


Exported = Callable[[str], tuple[System, Path]]


@pytest.mark.parametrize("case", CASES)
def test_the_bundle_gives_the_trainers_image(case: str, exported: Exported, measured: Measured) -> None:
    rules = CASES[case][2]
    system, bundle = exported(case)
    avatar = load(bundle)
    assert [str(p) for p in validate(bundle) if not p.warning] == []
    assert avatar.rig is not None
    assert [clip.name for clip in avatar.clips][:2] == ["held_out", "training"]
    for key in ("scale", "position", "rotation", "anchor"):
        if key in rules:
            assert getattr(avatar.rules, key) == rules[key]
    exact, fast, engine, live = compare(system, avatar)
    for row in (exact, fast, live):
        assert (row.frames, row.pixels) == (2, 2 * SIZE * SIZE)
        assert row.holds, row.backend
    assert engine.psnr_db >= 65
    measured("trained avatar, runtime against trainer, except for flips", max(exact.largest, fast.largest))
    measured("trained avatar, flipped pixels of 4608", max(exact.flipped, fast.flipped))
    measured("live model, rasteriser cpu against torch, except for flips", live.largest)
    _meets_its_reference(bundle, avatar)
    if case in DRAWN_BY_DEFINITION:
        _is_drawn_as_defined(bundle, avatar, system)


def test_a_take_with_held_out_frames_in_between_is_one_clip(exported: Exported) -> None:
    system, bundle = exported(next(iter(CASES)))
    frames = tuple(
        replace(one, split=("train", "test")[k % 2]) for k, one in enumerate(system.capture.frames)
    )
    [clip] = clips(replace(system.capture, frames=frames), load(bundle))
    assert (clip.name, clip.frames) == ("film", len(frames)) and len(frames) > 3


def _meets_its_reference(bundle: Path, avatar: Avatar) -> None:
    """Vectors and images by the trainer, on every backend."""
    read = opener(bundle)
    reference = read_reference(read_manifest(read), read)
    assert reference.made_by == "trainer"
    for backend in ("cpu", "gl"):  # `validate` has asked backend `reference`
        report = conform(avatar, reference, backend)
        assert [row for row in report.rows if not row.passed] == []
        assert [row for row in report.images if not row.passed] == []


def _is_drawn_as_defined(bundle: Path, avatar: Avatar, system: System) -> None:
    """The trainer's images of the reference, by the definition of the rasteriser."""
    read = opener(bundle)
    for vectors in read_reference(read_manifest(read), read).cases:
        for want in (vectors.images[name] for name in vectors.images if name == "trainer"):
            drawn = image(system, avatar, vectors.case, "torch")
            assert images.compare(drawn, want)[0] <= COLOUR_STEPS["rgba32f"], vectors.case.name


def test_a_head_of_identity_modes_is_under_no_body_models_terms(exported: Exported) -> None:
    _, bundle = exported("head of identity modes")
    said = load(bundle).provenance
    assert said["body_model_restriction"] == BODY_LICENCE + HEAD_LICENCE
    assert [str(p) for p in validate(bundle)] == []


def test_an_avatar_that_was_changed_on_its_way_is_noticed(exported: Exported) -> None:
    system, bundle = exported("splatting")
    avatar = load(bundle)
    tint, nothing = avatar.gaussians.sh.copy(), avatar.gaussians.sh.copy()
    front = int(np.argmax(avatar.gaussians.mean[:, 2]))
    tint[front] += 0.05
    nothing[front] = np.nan
    changed = {
        "rule": replace(avatar, rules=replace(avatar.rules, scale="log_area")),
        "colour": replace(avatar, gaussians=replace(avatar.gaussians, sh=tint)),
        "no number": replace(avatar, gaussians=replace(avatar.gaussians, sh=nothing)),
    }
    for what, other in changed.items():
        row, live = compare(system, other, backends=[("reference", "trainer")])
        assert not row.holds and live.holds, what


def test_backends_that_training_does_not_need_may_be_missing(
    exported: Exported, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, bundle = exported("splatting")
    avatar, found = load(bundle), importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "moderngl" else found(name))
    backends, missing = playable(avatar)
    assert backends == [("reference", "trainer"), ("cpu", "trainer")]
    assert len(missing) == 1 and "gl is not compared" in missing[0] and "[gl]" in missing[0]
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "numba" else found(name))
    with pytest.raises(AvatarError, match="numba"):
        playable(avatar)


def test_nothing_held_out_is_nothing_to_compare(exported: Exported) -> None:
    system, bundle = exported("splatting")
    other = copy(system)
    other.capture = replace(system.capture, frames=system.capture.train)
    with pytest.raises(AvatarError, match="has no held-out frames"):
        compare(other, load(bundle))
