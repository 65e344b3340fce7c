"""The vertex ids that a .glb carries: the row of each vertex in the mesh that the file was made from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from avatar_runtime.avatar import F64, I64
from avatar_runtime.codec.glb import Glb, accessor

ROW_LENGTH = 256  # ids in a row of the UV copy
FIRST_ROW = 2  # outside of the texture space 0..1
LARGEST = 1 << 24  # whole numbers in float32
ROUNDING = 1e-3  # of a tool that flips v


def vertex_ids(glb: Glb, attributes: Sequence[Mapping[str, Any]], first: I64) -> I64 | None:
    """The ids [V] of joined primitives: part i has rows first[i] : first[i + 1].

    From attribute `_VERTEX_ID`, else from its copy in TEXCOORD_0; None where any vertex has neither. The copy is
    u = id % 256, v = 2 + id // 256; a tool that flips v turns it into 1 - v <= -1.
    """
    found = []
    for part, begin, last in zip(attributes, first, first[1:], strict=False):
        ids = next(filter(lambda ids: ids is not None, _stated_ids(glb, part, int(last - begin))), None)
        if ids is None:
            return None
        found.append(ids)
    return np.concatenate(found)


def _stated_ids(glb: Glb, attributes: Mapping[str, Any], vertices: int) -> Iterator[I64 | None]:
    for name, decode in (("_VERTEX_ID", _plain_ids), ("TEXCOORD_0", _ids_of_uv)):
        if name in attributes:
            values = accessor(glb, attributes[name])
            if len(values) == vertices:
                with np.errstate(all="ignore"):
                    yield decode(values.astype(np.float64))


def _plain_ids(values: F64) -> I64 | None:
    if values.ndim != 1 or not (np.abs(values) < LARGEST).all() or (values != np.floor(values)).any():
        return None
    return values.astype(np.int64)


def _ids_of_uv(uv: F64) -> I64 | None:
    if uv.ndim != 2 or uv.shape[1] != 2 or not (np.abs(uv) < LARGEST).all():
        return None
    whole = np.round(uv)
    u, v = whole.T
    if (v <= -1).all():
        v = 1 - v
    fits = (v >= FIRST_ROW) & (u >= 0) & (u < ROW_LENGTH) & (np.abs(uv - whole) < ROUNDING).all(axis=1)
    return (u + ROW_LENGTH * (v - FIRST_ROW)).astype(np.int64) if fits.all() else None
