"""An enhancer does what its network says, and only networks that were looked through are run."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onnx import ModelProto, TensorProto, helper, numpy_helper

from avatar_runtime.avatar import Enhancer
from avatar_runtime.camera import Camera
from avatar_runtime.enhance import make_enhance
from avatar_runtime.enhance.network import read_network
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar, surface_avatar
from tests.enhancers import changed, expected, tiny
from tests.measured import Measure
from tests.session.fuzz import examples

SIZES = [(1, 1), (3, 5), (16, 12), (31, 64)]
CAMERA = Camera.orbit(np.zeros(3), 0.6, 0.3, 0.1, 0.5, 40, 33)


def image(height: int, width: int) -> Any:
    return np.random.default_rng(height).uniform(0, 1.2, (height, width, 3)).astype(np.float32)


@pytest.mark.parametrize("size", SIZES)
def test_it_gives_what_the_network_says(size: tuple[int, int], measured: Measure) -> None:
    colour = image(*size)
    better = make_enhance(tiny())(colour)
    off = np.abs(better - expected(colour)).max()
    measured("enhancer in ONNX Runtime against NumPy, of 1", off)
    assert better.shape == colour.shape and better.dtype == np.float32 and off < 2e-6
    assert np.abs(better - colour).max() > 0.1


@pytest.mark.parametrize("backend", ["reference", "cpu"])
def test_a_player_changes_colour_alone(backend: str) -> None:
    avatar, background = surface_avatar(), (0.75, 0.5, 0.25)
    raw = Player(avatar, backend).frame(Pose(), CAMERA, background)
    better = Player(avatar, backend, enhance=True).frame(Pose(), CAMERA, background)
    assert np.abs(better.image.colour - expected(raw.image.colour)).max() < 2e-6
    assert np.array_equal(better.image.transmittance, raw.image.transmittance)
    assert "enhance" in better.milliseconds and "enhance" not in raw.milliseconds
    assert better.image.colour.shape == (33, 40, 3)


def refusal(enhancer: Enhancer | None) -> str:
    with pytest.raises(AvatarError) as caught:
        make_enhance(enhancer)(image(8, 8))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_none_there() -> None:
    assert refusal(None) == "enhancer: this avatar has none; draw it as it is"
    with pytest.raises(AvatarError, match="this avatar has none"):
        Player(replace(full_avatar(), enhancer=None), "reference", enhance=True)


@pytest.mark.parametrize("library", ["onnx", "onnxruntime"])
def test_libraries_that_are_missing(monkeypatch: pytest.MonkeyPatch, library: str) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == library else found(name))
    with pytest.raises(AvatarError) as caught:
        Player(full_avatar(), "reference", enhance=True)
    assert str(caught.value) == f'enhancer: needs {library}: pip install -e ".[enhance]"'
    Player(full_avatar(), "reference").frame(Pose(), CAMERA)


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"onnx": b""}, "enhancer.onnx: is 0 bytes, expected 1 to 8388608"),
        ({"onnx": bytes((8 << 20) + 1)}, "enhancer.onnx: is 8388609 bytes, expected 1 to 8388608"),
        ({"onnx": b"no network"}, "enhancer.onnx: is not an ONNX file"),
        ({"input": ""}, "enhancer.input: is empty"),
        ({"input": "x"}, "enhancer.onnx: graph.input: is not 'x' alone, as the avatar says"),
        ({"output": "better"}, "enhancer.onnx: graph.output: is not 'better' alone, as the avatar says"),
        ({"trained_width": 0}, "enhancer.trained_width: is 0, expected 1 to 16384"),
        ({"trained_height": 16385}, "enhancer.trained_height: is 16385, expected 1 to 16384"),
        ({"psnr_raw_db": float("nan")}, "enhancer.psnr_raw_db: is nan, expected decibels or none"),
    ],
)
def test_facts_that_make_no_sense(facts: dict[str, Any], message: str) -> None:
    assert refusal(replace(tiny(), **facts)) == message


Change = Callable[[ModelProto], object]


def node(model: ModelProto, operator: str) -> Any:
    return next(node for node in model.graph.node if node.op_type == operator)


def constant(model: ModelProto, name: str) -> Any:
    return next(tensor for tensor in model.graph.initializer if tensor.name == name)


def put(model: ModelProto, name: str, values: Any) -> None:
    constant(model, name).CopyFrom(numpy_helper.from_array(np.asarray(values), name))


def set_attribute(model: ModelProto, operator: str, name: str, value: Any) -> None:
    found = node(model, operator)
    kept = [attribute for attribute in found.attribute if attribute.name != name]
    del found.attribute[:]
    found.attribute.extend([*kept, helper.make_attribute(name, value)])


def external(model: ModelProto) -> None:
    tensor = constant(model, "A")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="/etc/hostname")


def subgraph(model: ModelProto) -> None:
    node(model, "Relu").attribute.append(helper.make_attribute("body", model.graph))


def chain(model: ModelProto, operator: str, count: int, **attributes: Any) -> None:
    """`count` times the same layer between `raw` and the rest."""
    at = [node.op_type for node in model.graph.node].index("Conv")
    put_kernel = numpy_helper.from_array(np.ones((3, 3, *attributes["kernel_shape"]), np.float32), "K")
    model.graph.initializer.extend([put_kernel, numpy_helper.from_array(np.zeros(3, np.float32), "k")])
    names = ["raw", *(f"link{index}" for index in range(count))]
    for index in range(count):
        layer = helper.make_node(operator, [names[index], "K", "k"], [names[index + 1]], **attributes)
        model.graph.node.insert(at + index, layer)


def wide(model: ModelProto) -> None:
    """100 channels from 100, by 7 x 7."""
    many = {"L": (100, 3, 7, 7), "M": (100, 100, 7, 7), "l": (100,)}
    tensors = [numpy_helper.from_array(np.ones(shape, np.float32), name) for name, shape in many.items()]
    model.graph.initializer.extend(tensors)
    few, same = ({"kernel_shape": [7, 7], "strides": [n, n], "pads": [3] * 4} for n in (4, 1))
    model.graph.node.append(helper.make_node("Conv", ["raw", "L", "l"], ["few"], **few))
    for index in range(8):
        model.graph.node.append(helper.make_node("Conv", ["few", "M", "l"], [f"wide{index}"], **same))


REFUSED: dict[str, tuple[Change, str]] = {
    "operator": (lambda m: setattr(node(m, "Relu"), "op_type", "Loop"), "node 6: is 'Loop', not one of Add"),
    "operator set": (lambda m: setattr(m.opset_import[0], "version", 9), "opset_import: must be ONNX's own"),
    "function": (lambda m: m.functions.add(name="f"), "model: holds functions"),
    "subgraph": (subgraph, "positive: Relu goes with the attributes none"),
    "another file": (external, "initializer A: lies in another file"),
    "reference to an attribute": (
        lambda m: setattr(node(m, "Shape").attribute[0], "ref_attr_name", "x"),
        "size.start: is neither numbers nor text",
    ),
    "length": (lambda m: setattr(constant(m, "A"), "raw_data", b"1234"), "initializer A: is (5, 3, 1, 1)"),
    "huge size": (lambda m: constant(m, "A").dims.append(1 << 62), "initializer A: is (5, 3, 1, 1, 46"),
    "type": (lambda m: put(m, "A", np.ones((5, 3, 1, 1))), "initializer A: is not a named float32 or int64"),
    "not finite": (lambda m: put(m, "b", np.float32([1, np.nan, 0])), "initializer b: holds numbers that"),
    "many whole numbers": (lambda m: put(m, "none", np.zeros(9, np.int64)), "initializer none: is whole"),
    "name twice": (lambda m: constant(m, "B").__setattr__("name", "A"), "holds a duplicate name"),
    "output twice": (lambda m: node(m, "Add").output.__setitem__(0, "raw"), "node 8: Add must give one"),
    "input over a constant": (lambda m: constant(m, "A").__setattr__("name", "colour"), "holds a duplicate"),
    "second input": (lambda m: m.graph.input.append(m.graph.input[0]), "graph.input: is not 'colour' alone"),
    "type of the input": (
        lambda m: setattr(m.graph.input[0].type.tensor_type, "elem_type", TensorProto.DOUBLE),
        "graph.input: is not float32",
    ),
    "used before": (lambda m: m.graph.node.insert(0, m.graph.node.pop()), "enhanced: Slice takes 4 tensors"),
    "one input less": (lambda m: node(m, "Add").input.pop(), "better: Add takes 2 tensors"),
    "not given": (lambda m: m.graph.node.pop(), "enhanced: no node gives it"),
    "attribute missing": (lambda m: node(m, "Conv").attribute.pop(), "hidden: Conv goes with the attributes"),
    "stride": (lambda m: set_attribute(m, "Conv", "strides", [9, 9]), "hidden.strides: Conv: its value"),
    "padding mode": (lambda m: set_attribute(m, "Pad", "mode", "wrap"), "raw.mode: Pad: its value"),
    "kernel": (
        lambda m: put(m, "A", np.ones((5, 4, 1, 1), np.float32)),
        "hidden: Conv of a kernel (5, 4, 1, 1)",
    ),
    "sizes that differ": (lambda m: node(m, "Add").input.__setitem__(0, "positive"), "better: Add takes"),
    "floats where whole": (lambda m: node(m, "Neg").input.__setitem__(0, "colour"), "negative: Neg takes"),
    "no list": (lambda m: set_attribute(m, "Conv", "strides", 1), "hidden.strides: Conv: must be a list"),
    "whole where floats": (lambda m: node(m, "Relu").input.__setitem__(0, "size"), "positive: Relu takes"),
    "nothing left": (lambda m: put(m, "origin", np.array([999, 0])), "enhanced: Slice leaves nothing"),
    "divided by 0": (lambda m: put(m, "multiple", np.array([0])), "gap: Mod divides by 0"),
    "padded channels": (lambda m: put(m, "none", np.array([0, 1, 0, 0, 0, 0])), "raw: Pad by (0, 1, 0, 0"),
    "other axes": (lambda m: put(m, "axes", np.array([1, 3])), "enhanced: Slice of (0, 0) to"),
    "other size": (lambda m: put(m, "origin", np.array([1, 0])), "enhanced: gives (1, 3, 239, 320) for"),
    "numbers without end": (lambda m: put(m, "none", np.array([0, 0, 1 << 40, 0, 0, 0])), "pads: Concat"),
    "memory by growing": (
        lambda m: chain(m, "ConvTranspose", 20, kernel_shape=[4, 4], strides=[4, 4], pads=[0] * 4),
        "takes more than 512 values and 100000 multiplications a pixel",
    ),
    "many nodes": (
        lambda m: chain(m, "Conv", 250, kernel_shape=[7, 7], strides=[1, 1], pads=[3] * 4),
        "more than 256 nodes",
    ),
    "time in few": (wide, "takes more than 512 values and 100000 multiplications a pixel"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_networks_that_are_not_run(what: str) -> None:
    change, message = REFUSED[what]
    refused = refusal(changed(change))
    assert refused.startswith("enhancer.onnx: ") and message in refused


def test_a_size_that_only_then_does_not_fit() -> None:
    """Without padding the stride fits 240 x 320, and fails 9 x 7 by a message."""

    def halve(model: ModelProto) -> None:
        del model.graph.node[:]
        model.graph.initializer.append(numpy_helper.from_array(np.ones((3, 3, 2, 2), np.float32), "K"))
        two = {"kernel_shape": [2, 2], "strides": [2, 2], "pads": [0, 0, 0, 0]}
        model.graph.node.extend(
            [
                helper.make_node("Conv", ["colour", "K", "b"], ["half"], **two),
                helper.make_node("ConvTranspose", ["half", "K", "b"], ["enhanced"], **two),
            ]
        )

    run = make_enhance(changed(halve))
    assert run(image(6, 8)).shape == (6, 8, 3)
    with pytest.raises(AvatarError, match=r"enhanced: gives \(1, 3, 8, 6\) for an image of 7x9"):
        run(image(9, 7))


def test_colours_beyond_all_bounds_are_refused() -> None:
    run = make_enhance(changed(lambda m: put(m, "A", np.full((5, 3, 1, 1), 3e38, np.float32))))
    with pytest.raises(AvatarError, match="does not give an image of finite numbers"):
        run(image(4, 4))


@pytest.mark.parametrize("name", [b"hidden", b"Relu", b"kernel_shape", b"multiple"])
def test_names_that_are_no_text(name: bytes) -> None:
    """A tensor, an operator, an attribute, a constant."""
    refused = refusal(replace(tiny(), onnx=tiny().onnx.replace(name, name[:-1] + b"\xc2")))
    assert refused.startswith("enhancer.onnx: holds a name that is not UTF-8, b'")


@pytest.mark.parametrize("limits", [(10_000, 1 << 60), (1 << 60, 10_000)])
def test_an_image_that_takes_too_much(monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int]) -> None:
    """For a small one of few pixels there is room, for the size it was trained on there is none."""
    network = read_network(tiny())
    monkeypatch.setattr("avatar_runtime.enhance.network.MOST_IN_ALL", limits)
    network.check_size(8, 8)
    with pytest.raises(AvatarError, match="takes too much memory or time for 320x240; draw it smaller"):
        network.check_size(240, 320)


EDITS = st.lists(
    st.tuples(st.floats(0, 1), st.integers(0, 8) | st.just(1 << 30), st.binary(max_size=8)),
    min_size=1,
    max_size=4,
)


@settings(max_examples=examples(250))
@given(EDITS)
def test_mangled_bytes_are_run_or_refused(edits: list[tuple[float, int, bytes]]) -> None:
    data = bytearray(tiny().onnx)
    for where, gone, come in edits:
        at = int(where * len(data))
        data[at : at + gone] = come
    try:
        better = make_enhance(replace(tiny(), onnx=bytes(data)))(image(7, 9))
    except AvatarError as error:
        assert "\n" not in str(error)
    else:
        assert better.shape == (7, 9, 3)
