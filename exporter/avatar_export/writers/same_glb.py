"""Whether a .glb has the content that it would have if it were written again; for `validate`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from avatar_export.writers.glb_builder import Array
from avatar_runtime.codec.glb import accessor, decode, is_count, short

RELATIVE, ABSOLUTE = 1e-6, 1e-9  # a few units in the last place of float32, the rounding of another machine


def same_glb(old: bytes | memoryview, new: bytes | memoryview, file: object = None) -> str | None:
    """None if `old`, which is untrusted, has the content of `new`, else one phrase that names the difference.

    Equal bytes; or equal JSON but for asset.generator, with numbers within float32 rounding, and every accessor
    within 1e-6 of its value plus 1e-9. Bytes that no accessor reads are ignored. Raises AvatarError about `file`
    if `old` is not a sound GLB.
    """
    if old == new:
        return None
    ours = decode(new, file)
    theirs = decode(old, file)
    difference = _document_difference(theirs.document, ours.document, "")
    if difference:
        return difference
    for index in range(len(ours.entries("accessors"))):
        ours_values, theirs_values = accessor(ours, index), accessor(theirs, index)
        if not _close(theirs_values, ours_values):
            return f"accessors[{index}] ({_user(ours.document, index)}) has other values"
    return None


def _document_difference(old: object, new: object, where: str) -> str | None:
    if where == "asset.generator":
        return None
    if isinstance(new, dict):
        if not isinstance(old, dict) or old.keys() != new.keys():
            return f"{where or 'the document'} has other keys"
        pairs = [(f"{where}.{key}" if where else key, old[key], new[key]) for key in new]
    elif isinstance(new, list):
        if not isinstance(old, list) or len(old) != len(new):
            return f"{where} has another length"
        pairs = [(f"{where}[{index}]", a, b) for index, (a, b) in enumerate(zip(old, new, strict=True))]
    elif isinstance(new, float):
        return None if _close_number(old, new) else f"{where} is {short(old)}, not {new}"
    else:
        return None if type(old) is type(new) and old == new else f"{where} is {short(old)}, not {short(new)}"
    return next((found for at, a, b in pairs if (found := _document_difference(a, b, at))), None)


def _close_number(old: object, new: float) -> bool:
    if isinstance(old, float) or is_count(old):
        return abs(old - new) <= RELATIVE * abs(new) + ABSOLUTE
    return False


def _close(old: Array, new: Array) -> bool:
    if old.shape != new.shape or old.dtype != new.dtype:
        return False
    if new.dtype.kind != "f":
        return bool(np.array_equal(old, new))
    with np.errstate(over="ignore", invalid="ignore"):  # `old` may hold anything
        off = np.abs(old.astype(np.float64) - new)
    return bool((off <= RELATIVE * np.abs(new.astype(np.float64)) + ABSOLUTE).all())


def _user(document: Mapping[str, Any], index: int) -> str:
    """The use of an accessor, such as POSITION, by the first key of the document that points to it."""
    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            targets = enumerate(primitive.get("targets", []))
            for owner, name in ((primitive["attributes"], ""), *((t, f" of target {k}") for k, t in targets)):
                for key, value in owner.items():
                    if value == index:
                        return f"{key}{name}"
    return "indices, skin or animation"
