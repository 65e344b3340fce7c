"""Reads an untrusted ONNX file of an enhancer: checks it and builds a new model from the checked parts only.

Allowed are the operators of `operators`, each output computed once and before its use, so no loops, functions or
nested graphs; only numbers stored in the file itself; one input and one output. The cost of a run is known beforehand,
in values and in multiplications a pixel, and is limited.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import prod

import numpy as np
import onnx
from onnx import AttributeProto, GraphProto, ModelProto, NodeProto, TensorProto, helper, numpy_helper

from avatar_runtime.avatar import Enhancer
from avatar_runtime.checks.enhancer import check_enhancer
from avatar_runtime.codec.manifest import ENHANCER_FILE
from avatar_runtime.enhance.operators import OPERATORS, Attributes, Value
from avatar_runtime.io.errors import AvatarError

OPSETS = range(13, 22)  # in these the operators mean the same
IR_VERSION = 8  # of what is run; readers of all these opsets know it
MOST_NODES = 256
MOST_WHOLE = 8  # numbers of a constant that pads or crops
MOST_VALUES = 512  # a pixel, of all that is computed; ours has 110
MOST_PRODUCTS = 100_000  # multiplications a pixel; ours has 6,000
MOST_IN_ALL = 1 << 30, 1 << 37  # values and multiplications of one image: ours at 3840x2160 keeps below
MARGIN = 64  # pixels that small images may be made wider and higher
ATTRIBUTES = (AttributeProto.INT, AttributeProto.INTS, AttributeProto.STRING)
FLOAT, WHOLE = TensorProto.FLOAT, TensorProto.INT64
CHANNELS = 3


@dataclass(frozen=True)
class Node:
    """One checked operator."""

    operator: str
    inputs: tuple[str, ...]
    output: str
    attributes: Attributes


@dataclass(frozen=True)
class Network:
    """A checked enhancer."""

    model: ModelProto  # safe to run
    input: str
    output: str
    constants: dict[str, Value]
    nodes: tuple[Node, ...]

    def check_size(self, height: int, width: int) -> None:
        """Raise AvatarError unless an image of that size gives one of that size, within the limits."""
        known = self.constants | {self.input: Value((1, CHANNELS, height, width))}
        pixels, values, products = (height + MARGIN) * (width + MARGIN), 0, 0
        for node in self.nodes:
            operator, inputs = OPERATORS[node.operator], [known[name] for name in node.inputs]
            try:
                result = operator.result(inputs, node.attributes)
            except ValueError as error:
                raise _bad(f"{node.operator} {error}", node.output) from None
            values += prod(result.shape)
            products += operator.products_a_pixel(inputs) * prod(result.shape[2:])
            if values > MOST_VALUES * pixels or products > MOST_PRODUCTS * pixels:
                limits = f"{MOST_VALUES} values and {MOST_PRODUCTS} multiplications a pixel"
                raise _bad(f"takes more than {limits} for {width}x{height}", node.output)
            if values > MOST_IN_ALL[0] or products > MOST_IN_ALL[1]:
                raise _bad(
                    f"takes too much memory or time for {width}x{height}; draw it smaller", node.output
                )
            known[node.output] = result
        if known[self.output].shape != (1, CHANNELS, height, width):
            raise _bad(f"gives {known[self.output].shape} for an image of {width}x{height}", self.output)


def read_network(enhancer: Enhancer) -> Network:
    """The checked network of an enhancer. Raises AvatarError for anything that the module docstring does not allow."""
    check_enhancer(enhancer)  # its size, before it is parsed
    try:
        model = onnx.load_model_from_string(enhancer.onnx)
    except Exception:  # DecodeError of the library that onnx reads with
        raise AvatarError("is not an ONNX file", file=ENHANCER_FILE) from None
    opset = _opset(model)
    graph = model.graph
    _check_names(graph)
    if len(graph.node) > MOST_NODES or len(graph.initializer) > MOST_NODES:
        raise AvatarError(f"has more than {MOST_NODES} nodes or initialisers", file=ENHANCER_FILE)
    tensors = [_tensor(tensor) for tensor in graph.initializer]
    constants = {
        tensor.name: Value(tuple(tensor.dims), tuple(numpy_helper.to_array(tensor).tolist()))
        if tensor.data_type == WHOLE
        else Value(tuple(tensor.dims))
        for tensor in tensors
    }
    if len(constants) != len(tensors) or enhancer.input in constants:
        raise _bad("holds a duplicate name", "graph.initializer")
    _check_ends(graph, enhancer)
    nodes = tuple(_nodes(graph, {*constants, enhancer.input}))
    if enhancer.output not in {node.output for node in nodes}:
        raise _bad("no node gives it", enhancer.output)
    network = Network(
        _clean(enhancer, opset, tensors, nodes), enhancer.input, enhancer.output, constants, nodes
    )
    network.check_size(enhancer.trained_height, enhancer.trained_width)
    return network


def _bad(message: str, field: str) -> AvatarError:
    return AvatarError(message, file=ENHANCER_FILE, field=f"{field[:80]!a}"[1:-1] or "unnamed")


def _opset(model: ModelProto) -> int:
    """The one operator set of a model. Raises AvatarError for others beside it, and for functions."""
    sets = [(imported.domain, imported.version) for imported in model.opset_import]
    if len(sets) != 1 or sets[0][0] not in ("", "ai.onnx") or sets[0][1] not in OPSETS:
        raise _bad(f"must be ONNX's own, {OPSETS[0]} to {OPSETS[-1]}, alone", "opset_import")
    if model.functions or model.training_info or model.graph.sparse_initializer:
        raise _bad("holds functions, training or sparse tensors, which are not read", "model")
    return int(sets[0][1])


def _check_names(graph: GraphProto) -> None:
    """Raise AvatarError if a name is not text; the library then gives bytes."""
    names: list[object] = [tensor.name for tensor in graph.initializer]
    for node in graph.node:
        names += [node.op_type, node.domain, *node.input, *node.output]
        names += [name for attribute in node.attribute for name in (attribute.name, attribute.ref_attr_name)]
    for name in names:
        if not isinstance(name, str):
            raise AvatarError(f"holds a name that is not UTF-8, {str(name)[:80]}", file=ENHANCER_FILE)


def _tensor(tensor: TensorProto) -> TensorProto:
    """An initialiser whose numbers lie in it, made anew."""
    name, dims = tensor.name, tuple(tensor.dims)
    if not name or tensor.data_type not in (FLOAT, WHOLE) or tensor.HasField("segment"):
        raise _bad("is not a named float32 or int64 tensor", f"initializer {name}")
    if tensor.data_location == TensorProto.EXTERNAL or tensor.external_data:
        raise _bad("lies in another file, which is not read", f"initializer {name}")
    kind = np.dtype("<f4" if tensor.data_type == FLOAT else "<i8")
    if not 1 <= len(dims) <= 4 or min(dims) < 1 or prod(dims) * kind.itemsize != len(tensor.raw_data):
        raise _bad(f"is {dims} in {len(tensor.raw_data)} bytes of raw_data", f"initializer {name}")
    values = np.frombuffer(tensor.raw_data, kind).reshape(dims)
    if tensor.data_type == WHOLE and (len(dims) != 1 or len(values) > MOST_WHOLE):
        raise _bad(f"is whole numbers {dims}; up to [{MOST_WHOLE}] are read", f"initializer {name}")
    if not np.isfinite(values).all():
        raise _bad("holds numbers that are not finite", f"initializer {name}")
    return numpy_helper.from_array(values, name)


def _check_ends(graph: GraphProto, enhancer: Enhancer) -> None:
    for what, ends, name in (
        ("input", graph.input, enhancer.input),
        ("output", graph.output, enhancer.output),
    ):
        if [end.name for end in ends] != [name]:
            raise _bad(f"is not {name[:80]!a} alone, as the avatar says", f"graph.{what}")
        if ends[0].type.tensor_type.elem_type != FLOAT:
            raise _bad("is not float32", f"graph.{what}")


def _nodes(graph: GraphProto, known: set[str]) -> Iterator[Node]:
    """Every node, checked; `known` are the tensors that there are before the first."""
    for index, node in enumerate(graph.node):
        operator = OPERATORS.get(node.op_type)
        if operator is None or node.domain not in ("", "ai.onnx"):
            found = ascii(f"{node.domain}.{node.op_type}".lstrip(".")[:80])
            raise _bad(f"is {found}, not one of {', '.join(OPERATORS)}", f"node {index}")
        if len(node.output) != 1 or not node.output[0] or node.output[0] in known:
            raise _bad(f"{node.op_type} must give one tensor, of a new name", f"node {index}")
        output = node.output[0]
        if len(node.input) != operator.inputs or not known.issuperset(node.input):
            raise _bad(f"{node.op_type} takes {operator.inputs} tensors that are there before it", output)
        yield Node(node.op_type, tuple(node.input), output, _attributes(node))
        known.add(output)


def _attributes(node: NodeProto) -> Attributes:
    """The attributes of a node: all that its operator has, and no others."""
    allowed = OPERATORS[node.op_type].attributes
    if sorted(attribute.name for attribute in node.attribute) != sorted(allowed):
        raise _bad(f"{node.op_type} goes with the attributes {', '.join(allowed) or 'none'}", node.output[0])
    found = {}
    for attribute in node.attribute:
        if attribute.type not in ATTRIBUTES or attribute.ref_attr_name:
            raise _bad("is neither numbers nor text", f"{node.output[0]}.{attribute.name}")
        value = helper.get_attribute_value(attribute)
        several = list(value) if attribute.type == AttributeProto.INTS else [value]
        if len(several) > 4 or any(part not in allowed[attribute.name] for part in several):
            raise _bad(f"{node.op_type}: its value is not read", f"{node.output[0]}.{attribute.name}")
        if (attribute.type == AttributeProto.INTS) != isinstance(allowed[attribute.name], range):
            raise _bad(
                f"{node.op_type}: must be a list or must be none", f"{node.output[0]}.{attribute.name}"
            )
        found[attribute.name] = value
    return found


def _clean(enhancer: Enhancer, opset: int, tensors: list[TensorProto], nodes: tuple[Node, ...]) -> ModelProto:
    """A model of what was checked and nothing else."""
    shape = [1, CHANNELS, None, None]
    graph = helper.make_graph(
        [helper.make_node(node.operator, node.inputs, [node.output], **node.attributes) for node in nodes],
        "enhancer",
        [helper.make_tensor_value_info(enhancer.input, FLOAT, shape)],
        [helper.make_tensor_value_info(enhancer.output, FLOAT, shape)],
        tensors,
    )
    return helper.make_model(graph, ir_version=IR_VERSION, opset_imports=[helper.make_opsetid("", opset)])
