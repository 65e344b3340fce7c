"""What each attribute of a pack costs and spoils: bytes and image error against its step, measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.packing.quantise import Kept, quantised
from avatar_export.packing.steps import STEPS, WEIGHTS, Fineness
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.codec.pack import PackFile, encode
from avatar_runtime.program import fields
from avatar_runtime.program.bake import bake
from avatar_runtime.program.gaussians import SPARSE_PARTS

SIZED = (-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)  # log2 of the factors at which bytes are counted
SEEN = (0.0, 2.0)  # log2 of the factors at which errors are measured
ALMOST_EXACT = 1 / 32  # factor of the other attributes while one is measured
FINE = 1 / 8  # steps of log2 in which factors are chosen
Item = TypeVar("Item")
GRID = np.arange(SIZED[0], SIZED[-1] + FINE / 2, FINE)
POSES, VIEWS = 3, 2  # at most so many of the yardstick's are drawn to compare attributes


@dataclass(frozen=True)
class Curve:
    """Bytes and error of one attribute at each factor 2^GRID of its step."""

    bytes: F64  # [G]
    error: F64  # [G] share of the image error that all attributes have together at factor 1


def curves(avatar: Avatar, yardstick: Yardstick) -> dict[str, Curve]:
    """{path of an attribute: its curve}, for those that take bytes and show in images of `avatar`."""
    few = Yardstick(avatar, _spread(yardstick.poses, POSES), yardstick.views[:VIEWS], yardstick.backend)
    kept: Kept = {}
    sizes = [_sizes(avatar, 2.0**at, kept) for at in SIZED]
    paths = [path for path in sizes[0] if path in STEPS and max(size.get(path, 0) for size in sizes) > 0]
    if avatar.embedding is None:  # no image shows the mesh: it keeps its steps
        paths = [path for path in paths if not path.startswith("rig.")]
    # The mean PSNR depends on the relative error of each image, the worst one on the error of the worst image.
    square = _square(few.measure(quantised(avatar, Fineness(), kept)[0]))
    weight = 1 / np.sqrt(square * square.mean())
    exact = {path: ALMOST_EXACT for path in paths}
    floor = _square(few.measure(quantised(avatar, Fineness(1, exact), kept)[0]))
    found = {}
    for path in paths:
        errors = []
        for at in SEEN:
            fine = Fineness(1, {**exact, path: 2.0**at})
            error = _square(few.measure(quantised(avatar, fine, kept)[0])) - floor
            errors.append(max(float((error * weight).mean()), 1e-9))
        counted = np.interp(GRID, SIZED, [size.get(path, 0) for size in sizes])
        found[path] = Curve(np.minimum.accumulate(counted), _error(*errors))
    return found


def chosen(curves_: Mapping[str, Curve], price: float) -> dict[str, float]:
    """{path: factor} that makes bytes + `price` * error least for each attribute.

    Skin weights are never coarser than by default: users turn joints farther than the poses of a clip do.
    """
    found = {}
    for path, curve in curves_.items():
        allowed = (0 if path in WEIGHTS else GRID[-1]) >= GRID
        found[path] = float(2.0 ** GRID[int(np.argmin((curve.bytes + price * curve.error)[allowed]))])
    return found


def predict(curves_: Mapping[str, Curve], factors: Mapping[str, float]) -> tuple[float, float]:
    """(bytes, share of the error) that the curves promise for `factors`."""
    at = {path: _place(factor) for path, factor in factors.items()}
    return (
        float(sum(curves_[path].bytes[i] for path, i in at.items())),
        float(sum(curves_[path].error[i] for path, i in at.items())),
    )


def finer_within(
    curves_: Mapping[str, Curve], factors: Mapping[str, float], finest: Mapping[str, float], room: float
) -> dict[str, float]:
    """`factors` made finer, none finer than `finest`, where a byte buys most, for at most `room` more bytes."""
    found = {path: _place(factor) for path, factor in factors.items()}
    ends = {path: min(_place(finest[path]), at) for path, at in found.items()}
    while True:
        best: tuple[float, float, str, int] | None = None
        for path, at in found.items():
            curve = curves_[path]
            more = np.maximum(curve.bytes[ends[path] : at] - curve.bytes[at], 0.0)
            value = (curve.error[at] - curve.error[ends[path] : at]) / np.maximum(more, 1.0)
            value[more > room] = 0
            if len(value) and value.max() > (0 if best is None else best[0]):
                index = int(np.argmax(value))
                best = float(value[index]), float(more[index]), path, ends[path] + index
        if best is None:
            break
        _, more_bytes, path, found[path] = best
        room -= more_bytes
    return {path: float(2.0 ** GRID[at]) for path, at in found.items()}


def _place(factor: float) -> int:
    """Where a factor stands in GRID."""
    return round(float(np.log2(factor) - GRID[0]) / FINE)


def _error(at_one: float, at_four: float) -> F64:
    """A power of the step through both; for finer steps its square."""
    at_one = max(at_one, at_four / 2**5)  # some attributes have a finest step
    slope = min(max(np.log2(at_four / at_one) / (SEEN[1] - SEEN[0]), 0.5), 2.5)
    return at_one * 2.0 ** np.where(GRID < 0, 2 * GRID, slope * GRID)


def _square(measured: Measured) -> F64:
    """[P, V] mean squared errors inside the mask, or of the whole image where it is empty."""
    db = np.where(np.isnan(measured.inside), measured.whole, measured.inside)
    return np.asarray(10 ** (-db / 10), np.float64)


def _spread(items: Sequence[Item], count: int) -> list[Item]:
    """At most `count` of `items`, evenly spread, the last among them."""
    return [items[i] for i in sorted({round((k + 1) * len(items) / count) - 1 for k in range(count)} - {-1})]


def _sizes(avatar: Avatar, coarseness: float, kept: Kept) -> dict[str, int]:
    """{path of an attribute: its bytes in a file}, with the entries that a sparse part lists for it."""
    played, codes = quantised(avatar, Fineness(coarseness), kept)
    _, sizes = encode(PackFile({}, bake(played, codes)))
    found: dict[str, int] = {}
    for tensor, size in sizes.items():
        buffer, _, section = tensor.rpartition("/")
        path = _PATHS.get((buffer.split(".")[0], section))
        if path is not None:
            found[path] = found.get(path, 0) + size
    return found


def _paths() -> dict[tuple[str, str], str]:
    """{(kind of buffer, section): path of the attribute that the section holds or lists}."""
    found = {("BlendStatic", section): path for section, (path, _) in fields.BASE.items()}
    found |= {("EmbedStatic", section): path for section, (path, _) in fields.EMBEDDED.items()}
    found |= {("MorphStatic", "template_position"): "rig.vertices"}
    found |= {("SurfaceStatic", "canonical"): "embedding.canonical_vertices"}
    parts = {
        ("MorphStatic", "morph"): ("rig.morphs", fields.MORPH),
        ("MorphStatic", "corrective"): ("rig.correctives", fields.VERTEX_CORRECTIVE),
        ("SkinStatic", "late"): ("rig.late_morphs", fields.VERTEX_LATE),
        ("SkinStatic", "skin"): ("rig.skin", fields.SKIN),
    }
    for name, part in SPARSE_PARTS.items():
        parts["BlendStatic" if name in ("geometry", "appearance") else "BindStatic", name] = part
    for (buffer, name), (path, kinds) in parts.items():
        for attribute, (section, _) in kinds.items():
            found[buffer, section] = f"{path}.{attribute}"
        first = next(iter(kinds))
        found |= {(buffer, f"{name}_{what}"): f"{path}.{first}" for what in ("ptr", "column")}
    return found


_PATHS = _paths()
