"""The U-Net over an image: what it is before it is trained, that it learns, and that ONNX Runtime agrees."""

from __future__ import annotations

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from torch import Tensor

from avatar_runtime.enhance import make_enhance
from avatar_trainer.enhancer.network import (
    WEIGHTS,
    bias_name,
    enhanced,
    initial_weights,
    weight_name,
)
from avatar_trainer.enhancer.onnx_file import encode, onnx_enhancer
from tests.measured import Measure

SIZES = [(1, 1), (5, 9), (32, 24), (41, 63)]
FACTS = {
    "trained_width": 64,
    "trained_height": 48,
    "psnr_raw_db": 30,
    "psnr_enhanced_db": 31.5,
    "measured_on": "nothing",
}


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def trained(width: int = 8) -> dict[str, Tensor]:
    """Weights none of which is 0, as after training; corrections of about a tenth."""
    source = generator(1)
    weights = initial_weights(source, width)
    return {name: t + 0.03 * torch.randn(t.shape, generator=source) for name, t in weights.items()}


def test_weights_of_another_network_are_refused() -> None:
    weights = trained()
    with pytest.raises(ValueError, match="7 channels at half size"):
        initial_weights(generator(), 7)
    with pytest.raises(ValueError, match=r"weights lack enhancer\.half_up\.bias"):
        enhanced(
            {name: t for name, t in weights.items() if name != bias_name("half_up")}, torch.rand(4, 4, 3)
        )
    with pytest.raises(ValueError, match=r"enhancer.half_in.weight is \(8, 8, 5, 5\), not \(8, 8, 3, 3\)"):
        enhanced(weights | {weight_name("half_in"): torch.rand(8, 8, 5, 5)}, torch.rand(4, 4, 3))
    with pytest.raises(ValueError, match="is"):
        encode(weights | {weight_name("half_in"): torch.rand(8, 8, 5, 5)})


def test_gradients() -> None:
    names = [name for name in WEIGHTS if name.endswith(".bias")] + [weight_name("full_up")]
    weights = {name: tensor.double() for name, tensor in trained(2).items()}
    colour = torch.rand(3, 5, 3, generator=generator(), dtype=torch.float64, requires_grad=True)
    leaves = [weights[name].requires_grad_() for name in names]

    def run(colour: Tensor, *leaves: Tensor) -> Tensor:
        return enhanced(weights | dict(zip(names, leaves, strict=True)), colour)

    assert torch.autograd.gradcheck(run, (colour, *leaves))


@pytest.mark.parametrize("size", SIZES)
def test_the_file_computes_what_torch_does(size: tuple[int, int], measured: Measure) -> None:
    weights, colour = trained(), torch.rand(*size, 3, generator=generator())
    session = onnxruntime.InferenceSession(encode(weights), providers=["CPUExecutionProvider"])
    planes = np.ascontiguousarray(colour.permute(2, 0, 1)[None].numpy())
    (given,) = session.run(["enhanced"], {"colour": planes})
    expected = enhanced(weights, colour)
    off = float(np.abs(given[0].transpose(1, 2, 0) - expected.numpy()).max())
    measured("enhancer in ONNX Runtime against torch, of 1", off)
    assert off < 2e-6 and (expected - colour).abs().max() > 0.02


def test_the_runtime_takes_the_file(measured: Measure) -> None:
    weights, colour = trained(), torch.rand(45, 70, 3, generator=generator())
    better = make_enhance(onnx_enhancer(weights, **FACTS))(colour.numpy())
    measured(
        "enhancer in the runtime against torch, of 1",
        np.abs(better - enhanced(weights, colour).numpy()).max(),
    )
    assert np.abs(better - enhanced(weights, colour).numpy()).max() < 2e-6
    make_enhance(onnx_enhancer(initial_weights(generator(), 32), **FACTS))


def test_the_file_is_plain_onnx_and_always_the_same() -> None:
    weights = trained()
    data = encode(weights)
    assert data == encode({name: weights[name].clone() for name in reversed(WEIGHTS)})
    model = onnx.load_model_from_string(data)
    onnx.checker.check_model(model, full_check=True)
    assert (model.ir_version, [(o.domain, o.version) for o in model.opset_import]) == (8, [("", 15)])
    assert not model.producer_version and onnx.__version__.encode() not in data
    ends = [end.type.tensor_type for end in (*model.graph.input, *model.graph.output)]
    assert [[axis.dim_value or axis.dim_param for axis in end.shape.dim] for end in ends] == [
        [1, 3, "height", "width"]
    ] * 2
