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
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.reference import REFERENCE_FILES
from avatar_export.writers.reference_cases import reference_cases
from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance import Reference, conform, make_reference
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages import UNLIT
from avatar_runtime.stages import project as stage_project
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.measured import Measure

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
    assert [s["stage"] for s in cases[0]["stages"]] == [*UNLIT[:-1], "raster", "raster"]
    tensors = load_tensors(files["reference/vectors.safetensors"])
    assert 30 < len(tensors["rows"]) <= MOST_ROWS
    assert max(shape for t in tensors.values() if t.dtype == np.float32 for shape in t.shape[:1]) <= 4096
    assert [case["name"] for case in cases if not case["pictures"]] == ["close"]
    for case in cases:
        if case["name"] == "close":
            continue
        drawn = pixels(bundle, f"{case['name']}.engine.alpha.png")
        assert drawn.shape == (SIDE, SIDE)
        assert 0.05 < (drawn > 128).mean() < 0.9
        border = np.concatenate([drawn[0], drawn[-1], drawn[:, 0], drawn[:, -1]])
        assert np.median(border) == 0, "the camera sees the whole"
        if case["engine_psnr_db"] is not None:
            measured("engine against trainer at 256x256, samples, dB", case["engine_psnr_db"])


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


@pytest.mark.parametrize("plant", ["near plane", "clamp", "tile cull"])
@pytest.mark.parametrize("name", SAMPLES)
def test_a_reference_judges_what_projection_leaves_out(
    name: str, plant: str, only_close: Close, monkeypatch: pytest.MonkeyPatch
) -> None:
    avatar, reference = only_close(name)
    assert conform(avatar, reference, "reference").passed
    if plant == "near plane":
        avatar = replace(avatar, raster=replace(avatar.raster, near=-1e9))
    elif plant == "clamp":
        numbers = {**stage_project.constants(), "frustum_clamp": 1e9}
        monkeypatch.setattr(stage_project, "constants", lambda: numbers)
    else:
        monkeypatch.setattr(
            stage_project, "touched_tiles", lambda centre, *_: np.tile([0, 0, 1, 1], (len(centre), 1))
        )
    assert conform(avatar, reference, "reference").first_failure == "project"


def filled(field: str, value: float) -> Avatar:
    """The avatar with one Gaussian whose `field` is `value`."""
    avatar = full_avatar()
    array = getattr(avatar.gaussians, field).copy()
    array[3] = value
    return replace(avatar, gaussians=replace(avatar.gaussians, **{field: array}))


@pytest.mark.parametrize(("field", "value"), [("mean", 1e15), ("mean", 3e38), ("sh", 1e38), ("sh", 3.4e38)])
def test_only_a_reference_that_somebody_can_read_is_written(field: str, value: float, tmp_path: Path) -> None:
    """Such numbers are finite and legal, but no tolerance of the format holds for what comes of them."""
    with pytest.raises(AvatarError, match=rf"^reference: .* gaussians\.{field} at row 3"):
        written(filled(field, value), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    clip = full_avatar().clips[0]
    flat = clip.joint_delta.copy()
    flat[:, 1, :3, :3] = 0
    with pytest.raises(AvatarError, match=r"^reference: .*clip/bind/.*not finite"):
        written(replace(full_avatar(), clips=(replace(clip, joint_delta=flat),)), tmp_path / "out")
    large = written(filled("mean", 1e4), tmp_path / "out")
    assert [problem for problem in validate(large) if not problem.warning] == []
