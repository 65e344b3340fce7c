"""The truth of relighting: what the generator computes, the stage computes too, and a sample head comes near to it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from bench.light import db, floors, judged, made_of, scores
from samples.capture import light as capture_light
from samples.capture import shots as capture_shots
from samples.capture.light import LIGHTS, Scene, posed, write_light
from samples.capture.linear_light import Hits, display, harmonics, shaded
from samples.capture.model import Model

from avatar_runtime.avatar import Relight
from avatar_runtime.bundle import load as load_bundle
from avatar_runtime.light import light_arrays, light_of
from avatar_runtime.stages.light import ambient, direct, relit
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.head import BodyModel, Head, unit
from tests.measured import Measure

Array = npt.NDArray[Any]

SIZE = 96
BLENDSHAPES = Path(__file__).parents[2] / "samples" / "trained" / "head_blendshapes"
UPRIGHT = capture_light.POSES[:1] * 2


@pytest.fixture(scope="module", autouse=True)
def few() -> Iterator[None]:
    """Coarse images of one pose whose neck and whole are turned, in two lights."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_shots, "RAYS", 192)
        patch.setattr(capture_light, "POSES", capture_light.POSES[-1:] * 2)
        patch.setattr(capture_light, "LIGHTS", {name: LIGHTS[name] for name in ("right", "hard")})
        yield


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("light")
    write_light(folder, SIZE, shadow=True)
    return load(folder)


@pytest.mark.parametrize("name", LIGHTS)
def test_truth_and_stage_mean_the_same_light(name: str) -> None:
    """A matt ball that was captured in the light of the captures."""
    n = unit(np.random.default_rng(1).standard_normal((400, 3)))
    at, albedo, zero, one = 0.1 * n, np.array([0.5, 0.3, 0.02]), np.zeros(400), np.ones(400)
    light = light_of(LIGHTS[name])
    row = np.zeros(400, int)
    hits = Hits(row, row, at, n, np.tile(albedo, (400, 1)), one, one, zero, one)
    wanted = display(shaded(hits, light, np.array([0.0, 0.0, 1.0])))
    rows = np.array(capture_light.capture_light()["ambient"], np.float32)
    lit = light_arrays(
        light, Relight(np.zeros((0, 3), np.float32), rows, "head", (0.0, 0.0, 0.0), 1.0), np.eye(4)
    )
    n32, x32 = n.astype(np.float32), at.astype(np.float32)
    scene = ambient(n32, lit.ambient[:, :3])
    for place, colour in zip(lit.place, lit.colour, strict=True):
        scene = scene + direct(n32, x32, place)[:, None] * colour[:3]
    trained = display(albedo * (harmonics(n) @ rows)).astype(np.float32)
    found = relit(trained, scene, ambient(n32, rows))
    assert np.abs(np.clip(found, 0, 1) - wanted).max() < 1e-4


class Matt(Model):
    """The head without highlights."""

    gloss = np.array(0.0), np.array(1.0)


def test_captures_are_near_to_linear_light(
    head: Head, body: BodyModel, monkeypatch: pytest.MonkeyPatch, measured: Measure
) -> None:
    """Their light multiplies display values, and is stated as linear light."""
    monkeypatch.setattr(capture_light, "POSES", UPRIGHT)
    scene = Scene(Matt(head, body), posed(body), 0, SIZE)
    wanted, found = (
        scene.captured(),
        scene.lit(light_of({"ambient": capture_light.capture_light()["ambient"]})),
    )
    inside = wanted.alpha > 0.5
    reached = db(found.colour[inside], wanted.colour[inside])
    measured("linear light of the captures, dB", reached)
    assert reached > 44


def test_a_relit_head_is_near_to_its_truth(truth: Capture, measured: Measure) -> None:
    """Its colours and its shadow, in poses that turn neck and world."""
    made = made_of(load_bundle(BLENDSHAPES), truth)
    found = [score for score in scores(made, truth) if score.light != capture_light.CAPTURED]
    means = {way: fmean(score.db[way] for score in found) for way in found[0].db}
    measured("relit, dB", means["given"])
    assert len(found) == 4 and len(list(judged(found))) == 4
    assert means["given"] > means["baseline"] + 5
    assert min(dict(floors(made["given"], truth)).values()) > 0.9
