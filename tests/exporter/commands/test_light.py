"""Relighting on the command line: `--relight`, `--capture-light`, `render --light`, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_export.writers.bundle import write_bundle
from avatar_runtime.bundle import load
from avatar_runtime.light import sh_bases
from tests.commands import PLAIN, Refused, Run
from tests.exporter.relight.balls import ball

SMALL = ("--size", "48", "--backend", "reference")


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grey ball, without light."""
    out = tmp_path_factory.mktemp("ball") / "bundle"
    write_bundle(ball(), out, preview=False, engine_files=False, reference=False)
    return out


@pytest.fixture(scope="module")
def side(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The light of a capture that came from the avatar's left, in the world."""
    out = tmp_path_factory.mktemp("side") / "side.json"
    said = {"ambient": [0.5] * 3, "lights": [{"direction": [2, 0, 0], "colour": [0.5] * 3}], "frame": "world"}
    out.write_text(json.dumps(said))
    return out


def halves(path: Path) -> tuple[float, float]:
    """Mean brightness of the left and of the right half of an image."""
    pixels = np.asarray(Image.open(path).convert("RGB"), np.float64)
    middle = pixels.shape[1] // 2
    return float(pixels[:, :middle].mean()), float(pixels[:, middle:].mean())


def test_a_lit_avatar_from_the_command_to_the_image(
    bundle: Path, side: Path, run: Run, tmp_path: Path
) -> None:
    lit, out = tmp_path / "lit", tmp_path / "x.png"
    assert run("convert", bundle, "-o", lit, "--relight", *PLAIN)[0] == 0
    assert "capture_light_moves_with" in run("inspect", lit)[1]
    assert "sound" in run("validate", lit)[1]
    assert run("render", lit, "-o", out, "--light", "left", *SMALL)[0] == 0
    left, right = halves(out)
    assert left > 1.5 * right  # its right, which is the left of the image
    packed = tmp_path / "x.avatar"
    told = ("--relight", "--capture-light", side, "--exact", "--no-preview")
    assert run("pack", lit, "-o", packed, *told)[0] == 0
    relight = load(packed).relight
    assert relight is not None and relight.frame == "world"
    assert (sh_bases(np.array([1.0, 0, 0])) @ relight.ambient).min() > 0.9
    assert run("render", packed, "-o", out, "--force", "--light", side, *SMALL)[0] == 0
    assert run("render", packed, "-o", tmp_path / "unlit.png", *SMALL)[0] == 0
    np.testing.assert_allclose(
        halves(out), halves(tmp_path / "unlit.png"), atol=6
    )  # its own light changes little
    assert json.loads(run("inspect", packed, "--json")[1])["relight"]["capture_light_moves_with"] == "world"


BAD = {
    "point.json": (
        '{"lights": [{"position": [0, 0, 1], "colour": [1, 1, 1]}]}',
        "a point light is no light of a capture",
    ),
    "frame.json": ('{"ambient": [1, 1, 1], "frame": "sun"}', "frame: is not one of head, world"),
    "nan.json": ('{"ambient": [NaN, 1, 1]}', "ambient"),
    "list.json": ("[]", "is no JSON object"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_light_of_a_capture(name: str, bundle: Path, refused: Refused, tmp_path: Path) -> None:
    text, message = BAD[name]
    (tmp_path / name).write_text(text)
    out = tmp_path / "out"
    said = refused("convert", bundle, "-o", out, "--relight", "--capture-light", tmp_path / name, *PLAIN)
    assert name in said and message in said and not out.exists()


def test_options_that_need_each_other(bundle: Path, side: Path, refused: Refused, tmp_path: Path) -> None:
    out = tmp_path / "x.avatar"
    assert "--capture-light: needs --relight" in refused("pack", bundle, "-o", out, "--capture-light", side)
    said = refused("render", bundle, "-o", tmp_path / "x.png", "--light", "left", *SMALL)
    assert "pack --relight" in said
    assert "studio, left, rim" in refused(
        "render", bundle, "-o", tmp_path / "x.png", "--light", "noon", *SMALL
    )
    assert list(tmp_path.iterdir()) == []
