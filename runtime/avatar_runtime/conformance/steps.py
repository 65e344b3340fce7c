"""The steps of reference vectors as JSON beside a file of tensors, both directions."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from typing import Any

from avatar_runtime.conformance.model import Expected, Step, Tensor
from avatar_runtime.io.errors import AvatarError

Find = Callable[[Mapping[str, Any]], str]  # the entry of a tensor -> its name


def step_tensors(step: Step) -> list[str]:
    """The tensors of a step."""
    of_outputs = [t for e in step.outputs.values() for t in (e.tensor, e.weight) if t is not None]
    return [*step.inputs.values(), *of_outputs, *([] if step.pixels is None else [step.pixels])]


def json_text(document: dict[str, Any]) -> str:
    """JSON that people can read: indented, with a list of numbers on one line."""
    text = json.dumps(document, indent=1, ensure_ascii=False)
    return re.sub(r"\[\n[^\[\]{}]*\]", lambda found: " ".join(found[0].split()), text) + "\n"


def tensor_entry(name: str, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    """What a document says of a tensor."""
    return {"tensor": name, "dtype": tensors[name].dtype.name, "shape": list(tensors[name].shape)}


def step_entry(step: Step, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    """A step as a document says it."""
    said: dict[str, Any] = {"stage": step.stage}
    if step.profile is not None:
        said["profile"] = step.profile
    said["inputs"] = {array: tensor_entry(name, tensors) for array, name in step.inputs.items()}
    said["outputs"] = {array: _output(expected, tensors) for array, expected in step.outputs.items()}
    if step.pixels is not None:
        said["pixels"] = tensor_entry(step.pixels, tensors)
    return said


def _output(expected: Expected, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    said = tensor_entry(expected.tensor, tensors) | {"atol": expected.atol, "rtol": expected.rtol}
    if expected.weight is not None:
        said["weight"] = tensor_entry(expected.weight, tensors)
    if expected.flips is not None:
        said |= {"flips": expected.flips, "most_flips": expected.most_flips}
    return said


def tensor_finder(held: Mapping[str, Tensor], document: str, vectors: str) -> Find:
    """The name in a tensor's entry in the file `document`, once it is in `held`, the tensors of the file `vectors`.

    What it returns raises AvatarError for a tensor that is missing or of another type or shape.
    """

    def find(said: Mapping[str, Any]) -> str:
        name = str(said["tensor"])
        if name not in held:
            raise AvatarError("is missing", file=vectors, field=name)
        a, dtype, shape = held[name], said["dtype"], tuple(map(int, said["shape"]))
        if a.dtype.name != dtype or a.shape != shape:
            want, found = f"{dtype}{list(shape)}", f"{a.dtype.name}{list(a.shape)}"
            raise AvatarError(f"is {found}, {document} says {want}", file=vectors, field=name)
        return name

    return find


def decode_step(said: Mapping[str, Any], tensor: Find) -> Step:
    """The step of an entry; `tensor` is a `tensor_finder`."""
    return Step(
        said["stage"],
        said.get("profile"),
        {array: tensor(entry) for array, entry in said["inputs"].items()},
        {
            array: Expected(
                tensor(entry),
                float(entry["atol"]),
                float(entry["rtol"]),
                tensor(entry["weight"]) if "weight" in entry else None,
                entry.get("flips"),
                int(entry.get("most_flips", 0)),
            )
            for array, entry in said["outputs"].items()
        },
        tensor(said["pixels"]) if "pixels" in said else None,
    )
