"""reference/ of a bundle: small, the same every time, of every input that the avatar has, and of this avatar."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from safetensors.numpy import load as load_tensors

from avatar_export.checks.bundle import validate
from avatar_export.images import seen
from avatar_export.readers.table import read
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.reference import REFERENCE_FILES
from avatar_export.writers.reference_cases import every_input, reference_cases
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.conformance import Case, Reference, conform, decode, make_reference
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.stages import STAGES
from avatar_runtime.stages import project as stage_project
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.measured import Measure
from tests.shared_data import shared

MOST_BYTES, MOST_ROWS, SIDE = 2_000_000, 512, 256
SAMPLES = ("blendshapes_avatar", "lam_avatar", "splatting_head_sh3_avatar", "body_avatar")


def written(avatar: Avatar, folder: Path, **options: Any) -> Path:
    write_bundle(avatar, folder, preview=False, engine_files=False, **options)
    return folder


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(full_avatar(), tmp_path_factory.mktemp("reference") / "out")


@pytest.fixture(scope="module")
def sample_bundles(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """A sample's name -> its bundle, which tests must not change."""
    folder = tmp_path_factory.mktemp("samples")
    return cache(lambda name: written(request.getfixturevalue(name), folder / name))


def document(bundle: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((bundle / "reference" / "cases.json").read_text("utf-8"))
    return found


def pixels(bundle: Path, name: str) -> npt.NDArray[np.float64]:
    data = (bundle / "reference" / name).read_bytes()
    return np.asarray(Image.open(io.BytesIO(data)), np.float64)


@pytest.mark.parametrize("name", SAMPLES)
def test_small_and_sound_on_every_system(
    name: str, request: pytest.FixtureRequest, sample_bundles: Callable[[str], Path], measured: Measure
) -> None:
    avatar: Avatar = request.getfixturevalue(name)
    bundle = sample_bundles(name)
    files = {path: data for path, data in bundles.contents(bundle).items() if path.startswith("reference/")}
    assert set(files) <= set(REFERENCE_FILES)
    size = sum(map(len, files.values()))
    measured("size of reference/, MB", size / 1e6)
    assert size <= MOST_BYTES
    cases = document(bundle)["cases"]
    assert [case["name"] for case in cases] == ["rest", "posed", "close", "clip"][: 4 if avatar.clips else 3]
    assert [s["stage"] for s in cases[0]["stages"]] == [*STAGES[:-1], "raster", "raster"]
    tensors = load_tensors(files["reference/vectors.safetensors"])
    assert 30 < len(tensors["rows"]) <= MOST_ROWS
    assert max(shape for t in tensors.values() if t.dtype == np.float32 for shape in t.shape[:1]) <= 4096
    assert [case["name"] for case in cases if not case["pictures"]] == ["close"]
    for case in cases:
        if not case["pictures"]:
            continue
        drawn = pixels(bundle, f"{case['name']}.engine.alpha.png")
        assert drawn.shape == (SIDE, SIDE)
        assert 0.05 < (drawn > 128).mean() < 0.9
        border = np.concatenate([drawn[0], drawn[-1], drawn[:, 0], drawn[:, -1]])
        assert np.median(border) == 0, "the camera sees the whole"
        if case["engine_psnr_db"] is not None:
            measured("engine against trainer at 256x256, samples, dB", case["engine_psnr_db"])


def test_small_on_a_real_avatar(tmp_path: Path) -> None:
    bundle = written(read(shared("lam/p2-1.zip")), tmp_path / "out")
    assert sum(path.stat().st_size for path in (bundle / "reference").iterdir()) <= MOST_BYTES


def test_the_posed_case_leaves_no_input_at_rest() -> None:
    avatar = full_avatar()
    pose = every_input(avatar)
    weights = list(pose.expressions.values())
    assert tuple(pose.expressions) == avatar.expression_names
    assert all(weights) and len({abs(w) for w in weights}) == len(weights), "a swap of two would show"
    for expression in avatar.expressions:
        low, high = expression.range
        assert low <= pose.expressions[expression.name] <= high
    assert set(pose.eyelids) == set(avatar.eyelids) and all(pose.eyelids.values())
    assert avatar.rig is not None
    assert set(pose.joints) == set(avatar.rig.joint_names)
    turns = [m[:3, :3] for m in (*pose.joints.values(), pose.world_from_avatar)]
    for turn in turns:
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert (np.abs(turn - np.eye(3))[~np.eye(3, dtype=bool)] > 1e-4).all(), "about no axis of the frame"
    assert (pose.world_from_avatar[:3, 3] != 0).all()
    axes = np.array([[t[2, 1] - t[1, 2], t[0, 2] - t[2, 0], t[1, 0] - t[0, 1]] for t in turns])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    cosines = np.abs(axes @ axes.T)[~np.eye(len(axes), dtype=bool)]
    assert cosines.max() < 0.999, "each about an axis of its own"


def test_the_camera_looks_at_the_pose() -> None:
    avatar = full_avatar()
    pose = every_input(avatar)
    world = pose.world_from_avatar.copy()
    world[0, 3] += 5
    far = replace(pose, world_from_avatar=world)
    low, high = seen(avatar, far)
    mean = Player(avatar, "reference").animate(far).mean
    assert ((low >= mean.min(axis=0) - 1e-6) & (high <= mean.max(axis=0) + 1e-6) & (high > low)).all()


def test_what_an_avatar_lacks_is_not_asked_for() -> None:
    bare = replace(surface_avatar(rigged=False), eyelids=(), clips=())
    names = {case.name: case.pose for case in reference_cases(bare)}
    assert list(names) == ["rest", "posed", "close"]
    assert not names["posed"].joints and not names["posed"].eyelids


def test_all_tensors_of_the_posed_case_hold_values(bundle: Path) -> None:
    tensors = load_tensors((bundle / "reference" / "vectors.safetensors").read_bytes())
    posed = {name: t for name, t in tensors.items() if name.startswith("posed/")}
    assert len(posed) > 30
    for name, tensor in posed.items():
        assert name.endswith("background") or (tensor != 0).any(), name


def drawn_case(case: Case) -> bool:
    return case.images


@pytest.fixture(scope="module")
def only_close(request: pytest.FixtureRequest) -> Callable[[str], tuple[Avatar, Reference]]:
    """Name of an avatar -> it, and the vectors of its case `close` alone."""
    made = {"full": full_avatar, "surface": surface_avatar}

    @cache
    def close(name: str) -> tuple[Avatar, Reference]:
        avatar: Avatar = made[name]() if name in made else request.getfixturevalue(name)
        (case,) = (case for case in reference_cases(avatar) if case.name == "close")
        return avatar, make_reference(avatar, [case])

    return close


Close = Callable[[str], tuple[Avatar, Reference]]


@pytest.mark.parametrize("name", [*SAMPLES, "full", "surface"])
def test_a_reference_has_what_projection_decides_by_thresholds(name: str, only_close: Close) -> None:
    """Rows behind the camera, before the near plane, drawn beyond the clamp, on no tile: more than may flip."""
    avatar, reference = only_close(name)
    camera, tensors = reference.cases[0].case.camera, reference.tensors
    mean = tensors["close/bind/mean"].astype(np.float64)
    x, y, z = camera.camera_from_world[:3, :3] @ mean.T + camera.camera_from_world[:3, 3:]
    drawn, near = tensors["close/project/radius"] > 0, avatar.raster.near
    beyond = np.maximum(np.abs(x), np.abs(y)) > 1.3 * camera.tan_half_fov_x * z
    rows = {
        "behind": z < 0,
        "before the near plane": (z > 0) & (z < near),
        "drawn": drawn,
        "drawn beyond the clamp": drawn & beyond,
        "on no tile": ~drawn & (z > near),
    }
    (step,) = (step for step in reference.cases[0].steps if step.stage == "project")
    most = step.outputs["radius"].most_flips
    assert min(np.count_nonzero(mask) for mask in rows.values()) > most, rows


def no_near_plane(avatar: Avatar, monkeypatch: pytest.MonkeyPatch) -> Avatar:
    return replace(avatar, raster=replace(avatar.raster, near=-1e9))


def no_clamp(avatar: Avatar, monkeypatch: pytest.MonkeyPatch) -> Avatar:
    numbers = {**stage_project.constants(), "frustum_clamp": 1e9}
    monkeypatch.setattr(stage_project, "constants", lambda: numbers)
    return avatar


def no_tile_cull(avatar: Avatar, monkeypatch: pytest.MonkeyPatch) -> Avatar:
    monkeypatch.setattr(
        stage_project, "touched_tiles", lambda centre, *_: np.tile([0, 0, 1, 1], (len(centre), 1))
    )
    return avatar


@pytest.mark.parametrize("plant", [no_near_plane, no_clamp, no_tile_cull])
@pytest.mark.parametrize("name", SAMPLES)
def test_a_reference_judges_what_projection_leaves_out(
    name: str, plant: Any, only_close: Close, monkeypatch: pytest.MonkeyPatch
) -> None:
    avatar, reference = only_close(name)
    assert conform(avatar, reference, "reference").passed
    report = conform(plant(avatar, monkeypatch), reference, "reference")
    assert {row.stage for row in report.rows if not row.passed} >= {"project"}
    assert report.first_failure == "project"


def test_images_are_of_the_whole_avatar(bundle: Path) -> None:
    avatar = load(bundle)
    player = Player(avatar, "reference")
    for case in filter(drawn_case, reference_cases(avatar)):
        for profile in ("trainer", "engine"):
            image = player.frame(case.pose, case.camera, case.background, profile).image
            colour = 255 * np.clip(image.colour, 0, 1).astype(np.float64)
            alpha = 255 * (1 - image.transmittance.astype(np.float64))
            assert colour.max() > 50
            assert np.abs(pixels(bundle, f"{case.name}.{profile}.png") - colour).max() <= 0.501
            assert np.abs(pixels(bundle, f"{case.name}.{profile}.alpha.png") - alpha).max() <= 0.501


def test_the_manifest_says_who_made_it_and_how_far_the_profiles_lie_apart(
    sample_bundles: Callable[[str], Path], splatting_head_sh3_avatar: Avatar
) -> None:
    bundle = sample_bundles("splatting_head_sh3_avatar")
    said = bundles.manifest(bundle)["reference"]
    assert said["made_by"] == document(bundle)["made_by"] == "runtime"
    player = Player(splatting_head_sh3_avatar, "reference")
    cases = filter(drawn_case, reference_cases(splatting_head_sh3_avatar))
    for entry, case in zip(said["cases"], cases, strict=True):
        a, b = (player.frame(case.pose, case.camera, (0, 0, 0), p).image for p in ("engine", "trainer"))
        drawn = (a.transmittance < 1) | (b.transmittance < 1)
        noise = np.mean((a.colour[drawn].astype(np.float64) - b.colour[drawn]) ** 2)
        assert entry["name"] == case.name
        assert entry["engine_psnr_db"] == pytest.approx(10 * np.log10(1 / noise), abs=1e-6)


def test_it_can_be_left_out(tmp_path: Path) -> None:
    bundle = written(full_avatar(), tmp_path / "out", reference=False)
    assert bundles.manifest(bundle)["reference"] is None
    assert not (bundle / "reference").exists()


def test_it_says_which_files_it_was_made_for(bundle: Path) -> None:
    normative = {e["path"]: e["sha256"] for e in bundles.manifest(bundle)["files"] if not e["derived"]}
    del normative["enhancer.onnx"]  # no stage goes through it
    assert len(normative) == 4
    assert document(bundle)["files"] == normative


def test_the_same_images_from_a_left_handed_bundle(bundle: Path, tmp_path: Path) -> None:
    right, left = bundle, written(full_avatar(), tmp_path / "left", handedness="left")
    for file in sorted((right / "reference").glob("*.png")):
        off = np.abs(pixels(right, file.name) - pixels(left, file.name))
        assert off.max() <= 1, file.name
    stored = load(left, as_stored=True)
    reference = decode(lambda name, most: (left / "reference" / name).read_bytes())
    assert conform(stored, reference, "reference").passed
    assert validate(left) == []
    a, b = (load_tensors((side / "reference" / "vectors.safetensors").read_bytes()) for side in (right, left))
    assert np.array_equal(a["posed/bind/mean"] * [-1, 1, 1], b["posed/bind/mean"])


def filled(field: str, value: float) -> Avatar:
    """The avatar with one Gaussian whose `field` is `value`."""
    avatar = full_avatar()
    array = getattr(avatar.gaussians, field).copy()
    array[3] = value
    return replace(avatar, gaussians=replace(avatar.gaussians, **{field: array}))


@pytest.mark.parametrize(("field", "value"), [("mean", 1e15), ("mean", 3e38), ("sh", 1e38), ("sh", 3.4e38)])
def test_a_reference_that_nobody_could_read_is_not_written(field: str, value: float, tmp_path: Path) -> None:
    """Such numbers are finite and legal, but no tolerance of the format holds for what comes of them."""
    want = rf"^reference: cannot be made \(.*\): the avatar's largest number is .*, in gaussians\.{field} at row 3; "
    with pytest.raises(AvatarError, match=want):
        written(filled(field, value), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_large_numbers_that_can_be_compared_are_written(tmp_path: Path) -> None:
    assert validate_errors(written(filled("mean", 1e4), tmp_path / "out")) == []


def validate_errors(bundle: Path) -> list[str]:
    return [str(problem) for problem in validate(bundle) if not problem.warning]


def test_a_clip_that_flattens_a_joint_has_no_reference(tmp_path: Path) -> None:
    avatar = full_avatar()
    flat = avatar.clips[0].joint_delta.copy()
    flat[:, 1, :3, :3] = 0
    avatar = replace(avatar, clips=(replace(avatar.clips[0], joint_delta=flat),))
    with pytest.raises(AvatarError, match=r"^reference: cannot be made \(.*clip/bind/.*not finite\); mend"):
        written(avatar, tmp_path / "out")


def test_cases_are_the_same_every_time() -> None:
    def numbers(case: Case) -> list[Any]:
        return [case.name, *case.pose.expressions.values(), case.camera.clip_from_world.tobytes()]

    first, second = (list(map(numbers, reference_cases(full_avatar()))) for _ in range(2))
    assert first == second
