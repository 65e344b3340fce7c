"""The U-Net over an image: what it is before it is trained, that it learns, and that ONNX Runtime agrees."""

from __future__ import annotations

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from torch import Tensor

from avatar_runtime.enhance import make_enhance
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.enhancer.network import (
    MULTIPLE,
    WEIGHTS,
    bias_name,
    enhanced,
    initial_weights,
    weight_name,
    width_of,
)
from avatar_trainer.enhancer.onnx_file import encode, onnx_enhancer
from avatar_trainer.loop.machine import reproducible
from avatar_trainer.parameters.table import Table
from tests.measured import Measure

SIZES = [(1, 1), (5, 9), (32, 24), (41, 63)]
IMAGE = 32  # pixels, of what it learns on
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


@pytest.mark.parametrize("size", SIZES)
def test_untrained_it_changes_nothing(size: tuple[int, int]) -> None:
    colour = torch.rand(*size, 3, generator=generator())
    assert torch.equal(enhanced(initial_weights(generator()), colour), colour)


def test_the_weights_come_of_the_generator_alone() -> None:
    torch.manual_seed(1)
    first = initial_weights(generator(5))
    torch.manual_seed(2)
    second, other = initial_weights(generator(5)), initial_weights(generator(6))
    assert tuple(first) == WEIGHTS and all(torch.equal(first[name], second[name]) for name in WEIGHTS)
    assert not torch.equal(first[weight_name("half_down")], other[weight_name("half_down")])
    assert width_of(first) == 16 and width_of(initial_weights(generator(), 6)) == 6
    with pytest.raises(ValueError, match="7 channels at half size"):
        initial_weights(generator(), 7)


def test_weights_of_another_network_are_refused() -> None:
    weights = trained()
    with pytest.raises(ValueError, match=r"weights lack enhancer\.half_up\.bias"):
        enhanced(
            {name: t for name, t in weights.items() if name != bias_name("half_up")}, torch.rand(4, 4, 3)
        )
    with pytest.raises(ValueError, match=r"enhancer.half_in.weight is \(8, 8, 5, 5\), not \(8, 8, 3, 3\)"):
        enhanced(weights | {weight_name("half_in"): torch.rand(8, 8, 5, 5)}, torch.rand(4, 4, 3))
    with pytest.raises(ValueError, match="is"):
        encode(weights | {weight_name("half_in"): torch.rand(8, 8, 5, 5)})


def test_what_each_skip_carries() -> None:
    """With all else 0, `full_out` sees the raw colours as its first channels, and `correction` adds what it gives."""
    weights = {name: torch.zeros_like(t) for name, t in trained().items()}
    weights[weight_name("full_out")][2, 1, 1, 2] = 1  # hidden 2 is green, of the pixel to the right
    weights[weight_name("correction")][0, 2, 1, 1] = -0.5  # which is taken from red
    weights[bias_name("correction")][2] = 0.25
    colour = torch.rand(8, 16, 3, generator=generator())
    change = enhanced(weights, colour) - colour
    assert torch.allclose(change[:, :-1, 0], -0.5 * colour[:, 1:, 1], atol=1e-6)
    assert (change[..., 1] == 0).all() and torch.allclose(change[..., 2], torch.tensor(0.25), atol=1e-6)


def test_odd_sizes_are_images_whose_edge_goes_on() -> None:
    weights, colour = trained(), torch.rand(13, 18, 3, generator=generator())
    wider = torch.cat([colour, colour[:, -1:].expand(-1, -18 % MULTIPLE, -1)], dim=1)
    wider = torch.cat([wider, wider[-1:].expand(-13 % MULTIPLE, -1, -1)], dim=0)
    assert torch.allclose(enhanced(weights, colour), enhanced(weights, wider)[:13, :18], atol=1e-6)


def test_gradients() -> None:
    names = [name for name in WEIGHTS if name.endswith(".bias")] + [weight_name("full_up")]
    weights = {name: tensor.double() for name, tensor in trained(2).items()}
    colour = torch.rand(3, 5, 3, generator=generator(), dtype=torch.float64, requires_grad=True)
    leaves = [weights[name].requires_grad_() for name in names]

    def run(colour: Tensor, *leaves: Tensor) -> Tensor:
        return enhanced(weights | dict(zip(names, leaves, strict=True)), colour)

    assert torch.autograd.gradcheck(run, (colour, *leaves))


def blurred(image: Tensor) -> Tensor:
    planes = torch.nn.functional.avg_pool2d(image.permute(2, 0, 1)[None], 3, 1, 1, count_include_pad=False)
    return planes[0].permute(1, 2, 0)


def test_it_learns_in_a_table(measured: Measure) -> None:
    """Blurred circles become sharper, also circles that it was not trained on."""
    line = torch.linspace(-1, 1, IMAGE)
    y, x = torch.meshgrid(line, line, indexing="ij")

    def circles(seed: int) -> Tensor:
        place, colour = (
            torch.rand(12, 3, generator=generator(seed)),
            torch.rand(12, 3, generator=generator(seed)),
        )
        image = torch.zeros(IMAGE, IMAGE, 3)
        for (px, py, radius), tint in zip(place, colour, strict=True):
            inside = (x - 2 * px + 1) ** 2 + (y - 2 * py + 1) ** 2 < (0.1 + 0.4 * radius) ** 2
            image[inside] = tint
        return image

    table = Table()
    for name, tensor in initial_weights(generator()).items():
        table.add(name, tensor, 3e-3, rows=name)

    def error(seed: int) -> tuple[Tensor, Tensor]:
        sharp = circles(seed)
        soft = blurred(sharp)
        better = enhanced({name: table[name] for name in WEIGHTS}, soft)
        return ((better - sharp) ** 2).mean(), ((soft - sharp) ** 2).mean()

    with reproducible(seed=0, threads=1):
        for step in range(200):
            table.zero_grad()
            error(step)[0].backward()
            table.step()
    with torch.no_grad():
        left = [torch.stack(error(seed)) for seed in range(1000, 1008)]
    better, raw = torch.stack(left).mean(dim=0).tolist()
    gain = 10 * np.log10(raw / better)
    measured("enhancer, what it is worth on blurred circles, dB", gain)
    assert gain > 1.5


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
    """Its check knows all that is in it, and the widths that make sense stay below its limits."""
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


def test_facts() -> None:
    enhancer = onnx_enhancer(trained(), **FACTS)
    assert (enhancer.input, enhancer.output, enhancer.psnr_raw_db) == ("colour", "enhanced", 30.0)
    assert onnx_enhancer(trained(), **FACTS | {"psnr_raw_db": None}).psnr_raw_db is None
    with pytest.raises(AvatarError, match="trained_width: is 0"):
        onnx_enhancer(trained(), **FACTS | {"trained_width": 0})
