"""PSAvatar's losses: VGG's first layers from a file, and nothing without it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from avatar_runtime.codec import safetensors
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.systems.psavatar.losses import VGG_SHAPES, read_vgg
from tests.trainer.systems.psavatar import scene
from tests.trainer.systems.splatting_avatar import scene as sheet


def weights() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    return {name: rng.normal(0, 0.1, shape).astype("f4") for name, shape in VGG_SHAPES.items()}


def written(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    path.write_bytes(b"".join(bytes(piece) for piece in safetensors.encode(arrays)))
    return path


def by_hand(image: np.ndarray, w: dict[str, np.ndarray], row: int, column: int, channel: int) -> float:
    """One feature, window by window."""
    mean, deviation = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])
    normal = np.pad((image - mean) / deviation, ((1, 1), (1, 1), (0, 0)))

    def first(y: int, x: int) -> np.ndarray:
        if not (0 <= y < image.shape[0] and 0 <= x < image.shape[1]):
            return np.zeros(64)
        window = normal[y : y + 3, x : x + 3]
        return np.maximum(np.einsum("oiyx,yxi->o", w["features.0.weight"], window) + w["features.0.bias"], 0)

    total = float(w["features.2.bias"][channel])
    for dy in range(3):
        for dx in range(3):
            total += first(row + dy - 1, column + dx - 1) @ w["features.2.weight"][channel, :, dy, dx]
    return max(total, 0.0)


def test_features_are_those_of_the_first_four_layers(tmp_path: Path) -> None:
    w = weights()
    vgg = read_vgg(written(tmp_path / "vgg.safetensors", {**w, "features.5.weight": np.zeros(1, "f4")}))
    image = np.random.default_rng(3).uniform(0, 1, (5, 6, 3)).astype("f4")
    features = vgg(torch.from_numpy(image))
    assert features.shape == (64, 5, 6) and 0.2 < float((features > 0).float().mean()) < 0.8
    for row, column, channel in [(0, 0, 1), (2, 3, 40), (4, 5, 63), (1, 4, 17)]:
        wanted = by_hand(image.astype(float), w, row, column, channel)
        assert float(features[channel, row, column]) == pytest.approx(wanted, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("missing", "features.2.bias: is not there, expected float32"),
        ("shape", r"features.0.weight: is float32\[64, 3, 3\], expected float32\[64, 3, 3, 3\]"),
        ("type", r"features.0.bias: is float16\[64\]"),
        ("nan", "features.2.weight: is not finite"),
        ("no file", "cannot be read .*vgg=0 does without"),
        ("junk", "vgg.safetensors"),
    ],
)
def test_a_file_that_holds_no_such_network_is_refused(change: str, message: str, tmp_path: Path) -> None:
    w, path = weights(), tmp_path / "vgg.safetensors"
    if change == "missing":
        del w["features.2.bias"]
    elif change == "shape":
        w["features.0.weight"] = w["features.0.weight"][..., 0]
    elif change == "type":
        w["features.0.bias"] = w["features.0.bias"].astype("f2")
    elif change == "nan":
        w["features.2.weight"][3, 1, 0, 0] = np.nan
    if change == "junk":
        path.write_bytes(b"VGG")
    elif change != "no file":
        written(path, w)
    with pytest.raises(AvatarError, match=message) as error:
        read_vgg(path)
    assert "\n" not in str(error.value)


def test_training_takes_it_where_it_is_given(tmp_path: Path) -> None:
    path = written(tmp_path / "vgg.safetensors", weights())
    capture = sheet.blank(tmp_path / "sheet", frames=2)
    system = scene.system_of(capture, vgg=0.1, vgg_weights=str(path), dssim=0.0)
    step = scene.trainer_of(system).step(1, scene.read(capture.train[0]))
    assert set(step.terms) == {"l1", "vgg", "scale", "thin"} and step.terms["vgg"] > 0
    with pytest.raises(AvatarError, match="cannot be read"):
        scene.system_of(capture, vgg=0.1, vgg_weights=str(tmp_path / "none.safetensors"))
