"""LPIPS against its formulas in NumPy, loop by loop, with small networks of random weights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.evaluation.lpips import Lpips
from tests.measured import Measure

Array = npt.NDArray[Any]
# Of each slice: places of its convolutions in the network, kernel, stride, padding; (kernel, stride) of the pooling
# before it.
ALEX = (
    ((0,), 11, 4, 2, None),
    ((3,), 5, 1, 2, (3, 2)),
    ((6,), 3, 1, 1, (3, 2)),
    ((8,), 3, 1, 1, None),
    ((10,), 3, 1, 1, None),
)
VGG = (
    ((0, 2), 3, 1, 1, None),
    ((5, 7), 3, 1, 1, (2, 2)),
    ((10, 12, 14), 3, 1, 1, (2, 2)),
    ((17, 19, 21), 3, 1, 1, (2, 2)),
    ((24, 26, 28), 3, 1, 1, (2, 2)),
)
LIMIT = 2e-5  # relative: sums of some hundred float32 products, 24 bits each


def weights(network: Any, rng: np.random.Generator) -> dict[str, Array]:
    state: dict[str, Array] = {}
    before = 3
    for layer, (places, kernel, *_) in enumerate(network):
        for place in places:
            name = f"net.slice{layer + 1}.{place}"
            state[f"{name}.weight"] = rng.normal(0, 0.4, (4, before, kernel, kernel)).astype("f4")
            state[f"{name}.bias"] = rng.normal(0, 0.1, 4).astype("f4")
            before = 4
        state[f"lin{layer}.model.1.weight"] = rng.uniform(0, 1, (1, 4, 1, 1)).astype("f4")
    return state


def convolved(x: Array, weight: Array, bias: Array, stride: int, padding: int) -> Array:
    x = np.pad(x, ((0, 0), (padding, padding), (padding, padding)))
    k = weight.shape[-1]
    rows, columns = ((n - k) // stride + 1 for n in x.shape[1:])
    out = np.empty((len(weight), rows, columns))
    for i in range(rows):
        for j in range(columns):
            part = x[:, i * stride : i * stride + k, j * stride : j * stride + k]
            out[:, i, j] = (weight * part).sum(axis=(1, 2, 3)) + bias
    return np.maximum(out, 0)


def pooled(x: Array, kernel: int, stride: int) -> Array:
    rows, columns = ((n - kernel) // stride + 1 for n in x.shape[1:])
    out = np.empty((len(x), rows, columns))
    for i in range(rows):
        for j in range(columns):
            out[:, i, j] = x[:, i * stride : i * stride + kernel, j * stride : j * stride + kernel].max(
                axis=(1, 2)
            )
    return out


def features(image: Array, state: dict[str, Array], network: Any) -> list[Array]:
    x = image.transpose(2, 0, 1).astype(float) * 2 - 1
    x = (x - np.array([-0.030, -0.088, -0.188])[:, None, None]) / np.array([0.458, 0.448, 0.450])[
        :, None, None
    ]
    found = []
    for layer, (places, _, stride, padding, pool) in enumerate(network):
        x = x if pool is None else pooled(x, *pool)
        for place in places:
            name = f"net.slice{layer + 1}.{place}"
            x = convolved(x, state[f"{name}.weight"].astype(float), state[f"{name}.bias"], stride, padding)
        found.append(x / (np.sqrt((x**2).sum(axis=0)) + 1e-10))
    return found


@pytest.mark.parametrize(("network", "size"), [(ALEX, 67), (VGG, 33)], ids=["alex", "vgg"])
def test_formulas(network: Any, size: int, tmp_path: Path, measured: Measure) -> None:
    rng = np.random.default_rng(3)
    state = weights(network, rng)
    a, b = (rng.random((size, size + 4, 3)).astype("f4") for _ in range(2))
    wanted = 0.0
    for layer, pair in enumerate(zip(features(a, state, network), features(b, state, network), strict=True)):
        wanted += float(
            (state[f"lin{layer}.model.1.weight"][0] * (pair[0] - pair[1]) ** 2).sum(axis=0).mean()
        )
    torch.save({name: torch.from_numpy(value) for name, value in state.items()}, tmp_path / "w.pth")
    lpips = Lpips(tmp_path / "w.pth")
    got = lpips(torch.from_numpy(a), torch.from_numpy(b))
    off = abs(got - wanted) / wanted
    measured("LPIPS against its formulas in NumPy, relative", off, LIMIT)
    assert off < LIMIT
    assert lpips(torch.from_numpy(a), torch.from_numpy(a)) == 0
    with pytest.raises(ValueError, match="pixels a side"):
        lpips(torch.zeros(8, 90, 3), torch.zeros(8, 90, 3))


def test_other_files_are_named(tmp_path: Path) -> None:
    state = {name: torch.from_numpy(v) for name, v in weights(VGG, np.random.default_rng(0)).items()}
    cases = {
        "lin2": {name: value for name, value in state.items() if "lin2" not in name},
        "net.slice4": {name: value for name, value in state.items() if "slice4" not in name},
        "net.slice1.0.weight": {},
        "tensors by name": {"a": 1},
    }
    for says, content in cases.items():
        torch.save(content, tmp_path / "w.pth")
        with pytest.raises(AvatarError, match=f"{says}.*made by python -c"):
            Lpips(tmp_path / "w.pth")
    (tmp_path / "w.pth").write_bytes(b"no weights")
    with pytest.raises(AvatarError, match=r"is not a file of torch\.save"):
        Lpips(tmp_path / "w.pth")
    with pytest.raises(AvatarError, match="cannot be read"):
        Lpips(tmp_path / "none.pth")
