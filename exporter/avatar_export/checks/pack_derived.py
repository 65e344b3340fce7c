"""What a pack says of its own avatar, made again and compared: passes, framing, driving, bounds in motion, preview."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image

from avatar_export.measure.framing import framing, left_framing, preview_image
from avatar_export.measure.poses import poses
from avatar_export.ops.bounds import reach
from avatar_export.version import GENERATOR
from avatar_runtime.avatar import Avatar
from avatar_runtime.driving.linear_map import linear_map
from avatar_runtime.handedness import mirrored_boxes
from avatar_runtime.packs import Pack
from avatar_runtime.player import Player
from avatar_runtime.program.bake import bake_levels
from avatar_runtime.program.coded import coded_of
from avatar_runtime.program.model import Program
from avatar_schema.validate import Problem

# Metres, and of numbers of `driving`: what is made again on another machine may differ by roundings.
SAME = 1e-4
MOVED = 32  # poses that are tried; those of clips and of single expressions count, which `swept` has to hold
STRAY = 0.05  # of the box's size, by which a Gaussian may leave it: the box is an estimate for some bindings
LARGEST_PREVIEW = 4096  # pixels along an edge
# Of 255, mean over the pixels that either image covers; a lossy WebP of a coarse pack is below 10.
UNLIKE = 32.0


def program_problems(pack: Pack) -> Iterator[Problem]:
    """Buffers and passes that are not those of the avatar that the pack decodes to.

    The GPU follows the passes, `cpu` and `reference` follow the rules of the manifest: both must say the same. Only a
    warning for a pack of another version, whose exporter may lay out buffers in another way.
    """
    packed = pack.avatar.packed
    assert packed is not None
    program: Program = packed.program
    levels = [packed.at(level) for level in range(packed.levels)]
    made = bake_levels([(avatar, coded_of(program, level, avatar)) for level, avatar in enumerate(levels)])
    where = next(_different(program, made), None)
    if where is not None:
        message = (
            "is not what the avatar of this pack gives, so the GPU would not play what other backends play"
        )
        other_version = pack.document["asset"].get("generator") != GENERATOR
        yield Problem(f"$.program: {where}", message, warning=other_version)


def _different(program: Program, made: Program) -> Iterator[str]:
    """The places where two programs differ."""
    for name in ("pose", "pose_floats", "reads_mesh"):
        if getattr(program, name) != getattr(made, name):
            yield name
    lists = [("mesh", program.mesh, made.mesh)]
    for index, (one, other) in enumerate(zip(program.levels, made.levels, strict=True)):
        if (one.prefix, one.chunks) != (other.prefix, other.chunks):
            yield f"levels[{index}].chunks"
        lists += [
            (f"levels[{index}].{name}", getattr(one, name), getattr(other, name))
            for name in ("deform", "view", "shadow", "light")
        ]
    for name, passes, wanted in lists:
        if len(passes) != len(wanted):
            yield name
        for at, (first, second) in enumerate(zip(passes, wanted, strict=False)):
            for part in ("entry", "rows", "buffers", "constants"):
                if getattr(first, part) != getattr(second, part):
                    yield f"{name}[{at}].{part}"
    if program.buffers.keys() != made.buffers.keys():
        yield "buffers"
        return
    for name, buffer in program.buffers.items():
        sections, wanted_sections = (
            {s.name: s.elements for s in b.sections} for b in (buffer, made.buffers[name])
        )
        if buffer.size != made.buffers[name].size or sections.keys() != wanted_sections.keys():
            yield f"buffer {name}"
            continue
        for section, elements in sections.items():
            if not np.array_equal(elements, wanted_sections[section]):
                yield f"buffer {name}, section {section}"


def fact_problems(pack: Pack, finest: Avatar) -> Iterator[Problem]:
    """`framing` and `driving` that differ from those of the avatar; `finest` is placed and right-handed."""
    document = pack.document
    left = document["avatar"]["frame"]["handedness"] == "left"
    if "framing" in document:
        made = framing(finest)
        yield from _apart(document["framing"], left_framing(made) if left else made, "$.framing")
    if "driving" in document and finest.driving.mode != "none":
        linear = linear_map(pack.avatar)
        rows = [[float(value) for value in row] for row in linear.matrix]
        found = {"inputs": list(linear.inputs), "outputs": list(linear.outputs), "matrix": rows}
        yield from _apart(document["driving"], found, "$.driving")


def _apart(said: Any, made: Any, where: str) -> Iterator[Problem]:
    """Values of a document that differ from those made again: numbers by more than SAME."""
    if isinstance(said, Mapping) and isinstance(made, Mapping) and said.keys() == made.keys():
        for name, value in made.items():
            yield from _apart(said[name], value, f"{where}.{name}")
    elif not _same(said, made):
        yield Problem(where, "differs from what the avatar of this pack gives")


def _same(said: Any, made: Any) -> bool:
    if said is None or made is None:
        return said is made
    try:
        one, other = np.array(said, np.float64), np.array(made, np.float64)
    except (ValueError, TypeError):
        return bool(said == made)
    return one.shape == other.shape and bool((np.abs(one - other) <= SAME * (1 + np.abs(other))).all())


def motion_problems(document: Mapping[str, Any], levels: Sequence[Avatar]) -> Iterator[Problem]:
    """Gaussians that leave `bounds.swept`, in frames of clips and with single expressions at the end of their range.

    An engine does not draw an avatar whose box is out of sight. `levels` are placed and right-handed.
    """
    boxes = document["bounds"]
    swept = (mirrored_boxes(boxes) if document["frame"]["handedness"] == "left" else boxes)["swept"]
    low, high = np.array(swept["min"]), np.array(swept["max"])
    spare, limit = STRAY * (high - low).max(), float(np.finfo(np.float32).max)
    for index, level in enumerate(levels):
        player, worst = Player(level), (0.0, "")
        for named in poses(level, MOVED):
            if not named.name.startswith(("clip ", "expression ")):
                continue
            splats = player.animate(named.pose)
            extent = reach(splats.scale, splats.quat_wxyz)
            mean = splats.mean.astype(np.float64)
            drawn = np.isfinite(mean).all(axis=1) & np.isfinite(extent).all(axis=1)
            if not drawn.all():
                message = f"{int(np.sum(~drawn))} Gaussians have no finite place in the pose {named.name!r}"
                yield Problem(f"$.levels[{index}]", message, warning=True)
            beyond = np.maximum(low - (mean - extent), (mean + extent) - high)[
                drawn & (np.abs(mean) < limit).all(axis=1)
            ]
            worst = max(worst, (float(beyond.max(initial=0)), named.name))
        if worst[0] > spare:
            message = f"Gaussians of level {index} leave it by {worst[0]:.3g} m in the pose {worst[1]!r}"
            yield Problem("$.avatar.bounds.swept", message)


def preview_problems(pack: Pack, finest: Avatar) -> Iterator[Problem]:
    """A preview that is no WebP image, or shows something else than the pack; `finest` is placed and right-handed."""
    if pack.preview is None:
        return
    try:
        with Image.open(io.BytesIO(pack.preview), formats=["WEBP"]) as image:
            if image.width != image.height or image.width > LARGEST_PREVIEW:
                raise ValueError(
                    f"is {image.width} x {image.height}; a square up to {LARGEST_PREVIEW} is read"
                )
            stored = np.asarray(image.convert("RGBA"), np.float64)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        yield Problem("array preview", f"is not a still image that can be shown: {str(error)[:200]}")
        return
    made = preview_image(finest, len(stored)).astype(np.float64)
    covered = (stored[..., 3] > 0) | (made[..., 3] > 0)
    over_black = [image[..., :3] * image[..., 3:] / 255 for image in (stored, made)]
    apart = float(np.abs(over_black[0] - over_black[1])[covered].mean()) if covered.any() else 0.0
    if not apart <= UNLIKE:
        message = f"differs by {apart:.0f} of 255 from an image of this pack, so it shows something else"
        yield Problem("array preview", message)
