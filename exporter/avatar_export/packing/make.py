"""An avatar in, `NAME.avatar` out: the whole of `avatar-export pack` as one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from avatar_export.levels import coarser, served
from avatar_export.measure.claims import claim_poses, search_poses
from avatar_export.measure.framing import framing, left_framing, preview_webp
from avatar_export.measure.report import report_html
from avatar_export.measure.views import NamedView, in_turn, views
from avatar_export.measure.yardstick import Measured, Yardstick, compare
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.budget import by_part, coarsest, floor, refuse_below
from avatar_export.packing.choices import Choices
from avatar_export.packing.reference import reference_folder, reference_of, refuse_folder, write_folder
from avatar_export.packing.search import Aims, Found, aims_of, by_aims, by_size
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import Packing, Prepared, driving_facts, prepare, write
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import default_backend
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.text_files import refuse_existing, write_bytes, write_text
from avatar_runtime.packs import decode_pack, placed
from avatar_runtime.player import ABSURD

SIZE = 512  # pixels of the images that are compared
SEEN = 4  # of so many poses of a claim one sets the camera
DRAWS = 2  # claims that are measured, each in other poses: where one is short of the aims, steps become finer once
FIGURES = 1500  # bytes that the measured figures of a level take in the file, at most


DEFAULT = Choices()


@dataclass(frozen=True)
class Made:
    """A pack that was made, with its figures."""

    file: bytes
    parts: Mapping[str, int]  # bytes in the file, by part
    measured: tuple[Measured, ...]  # each level against the source, in poses that the search did not see
    counts: tuple[int, ...]  # Gaussians of each level
    met: bool  # whether the budget was met
    notes: tuple[str, ...] = ()
    document: Mapping[str, Any] = field(default_factory=dict)


@ABSURD
def make_pack(
    source: Avatar,
    out: Path,
    choices: Choices = DEFAULT,
    *,
    report: Path | None = None,
    reference: bool = False,
    force: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Made:
    """Write `source` as a pack to the file `out`, the page `report`, and with `reference` the folder beside it.

    `progress` is called with what is done next. Raises AvatarError for an unsound avatar, for a part that no buffer
    can hold, and if a file exists without `force`. On failure nothing is changed.
    """
    for path in (out, report):
        if path is not None:
            refuse_existing(path, force)
    if reference:
        refuse_folder(reference_folder(out), force)
    source = replace(source, packed=None)
    finest = reduced(source, choices.sh_degree)
    packer = _Packer(choices, preview_webp(finest) if choices.preview else None)
    floor_line = ""
    if choices.max_bytes is not None:  # before anything that takes minutes
        least = floor(packer.packed(*coarsest([finest])))
        refuse_below(least, choices.max_bytes)
        floor_line = f"no step makes smaller: {least.text()}"
        progress(floor_line)
    levels, left_out = _levels(finest, choices, progress)
    cameras = views(source, SIZE, [*search_poses(source), *claim_poses(source)[::SEEN]])
    aims, found = aims_of(source, choices.min_psnr), None
    if not choices.exact:
        progress("searching the steps")
        found = _searched(source, levels, aims, choices, cameras, packer)
    for draw in range(DRAWS):
        progress("packing")
        levels, fine = (levels, None) if found is None else (list(found.levels), found.fine)
        prepared = packer.prepare(levels, fine)
        played = [packer.right(level) for level in prepared.levels]
        progress("measuring")
        shots = in_turn(claim_poses(source, draw), cameras)
        allowance = 0.0 if choices.exact else aims.allowance
        measured = tuple(
            replace(one, allowance=allowance) for one in compare(source, played, shots, default_backend())
        )
        missing = aims.missed_by(measured[0])
        if found is None or choices.max_bytes is not None or missing <= 0 or found.finest:
            break
        if draw + 1 < DRAWS:
            found = found.finer(missing)
    served_by = served(played)
    if served_by.notes:  # rounding took what made a level worth its bytes
        left_out += served_by.notes
        prepared = packer.prepare([levels[index] for index in served_by.kept], fine)
        played = [packer.right(level) for level in prepared.levels]
        measured = tuple(measured[index] for index in served_by.kept)
    facts = _facts(played, served_by.heights, measured, choices, found)
    packing = write(prepared, facts, packer.preview, choices.handedness)
    decode_pack(packing.file, str(out))  # numbers that no reader takes are refused before they are written
    parts, met = by_part(packing), _met(packing, measured[0], choices)
    notes = (
        *([floor_line] if floor_line else []),
        *left_out,
        *_notes(finest, choices, aims, measured[0], found, met),
    )
    page = None
    if report is not None:
        progress("drawing the report")
        page = report_html(
            source,
            played[0],
            shots,
            measured[0],
            parts,
            title=source.name,
            facts=_settings(choices, aims, found),
        )
    files = {}
    if reference:
        progress("computing the reference")
        files = reference_of(packing.avatar, choices.handedness, packing.file)
    write_bytes(out, packing.file, force=force)
    if files:
        write_folder(reference_folder(out), files, force=force)
    if report is not None and page is not None:
        write_text(report, page, force=force)
    counts = tuple(level.gaussians.count for level in played)
    return Made(packing.file, parts, measured, counts, met, notes, facts)


class _Packer:
    """Prepares and writes packs by a user's choices, in the frame that was asked for."""

    def __init__(self, choices: Choices, preview: bytes | None) -> None:
        self.choices, self.preview = choices, preview

    def prepare(self, levels: Sequence[Avatar], fine: Fineness | None) -> Prepared:
        """The levels, in the pack's frame."""
        left = self.choices.handedness == "left"
        return prepare([mirrored(level) for level in levels] if left else levels, fine)

    def right(self, stored: Avatar) -> Avatar:
        """A level of the pack in the right-handed frame, in which it is measured."""
        return placed(mirrored(stored) if self.choices.handedness == "left" else stored)

    def packed(self, levels: Sequence[Avatar], fine: Fineness) -> Packing:
        """The file, without figures."""
        return write(self.prepare(levels, fine), None, self.preview, self.choices.handedness)

    def size(self, levels: Sequence[Avatar], fine: Fineness) -> int:
        """Bytes of the file with its figures."""
        return len(self.packed(levels, fine).file) + FIGURES * (1 + len(levels))


def _levels(
    avatar: Avatar, choices: Choices, progress: Callable[[str], None]
) -> tuple[list[Avatar], tuple[str, ...]]:
    """The levels that are worth their bytes, and notes on the others."""
    levels = [avatar]
    for part in choices.levels[1:]:
        progress(f"merging to {part:g} of the Gaussians")
        levels.append(coarser(avatar, part))
    shown = served(levels)
    return [levels[index] for index in shown.kept], shown.notes


def _searched(
    source: Avatar,
    levels: Sequence[Avatar],
    aims: Aims,
    choices: Choices,
    cameras: Sequence[NamedView],
    packer: _Packer,
) -> Found:
    """The steps that keep to the size or the aims."""
    yardstick = Yardstick(source, in_turn(search_poses(source), cameras), default_backend())
    if choices.max_bytes is not None:
        return by_size(levels, choices.max_bytes, yardstick, packer.size, coarser)
    # By default an avatar that is better at the usual steps stays so: little would be saved by losing it.
    return by_aims(levels, aims, yardstick, *([] if choices.min_psnr else [0.0]))


def _met(packing: Packing, measured: Measured, choices: Choices) -> bool:
    """Whether the file that was written keeps to what was asked for."""
    if choices.max_bytes is not None:
        return len(packing.file) <= choices.max_bytes
    return choices.min_psnr is None or measured.mean >= choices.min_psnr


def _notes(
    finest: Avatar, choices: Choices, aims: Aims, measured: Measured, found: Found | None, met: bool
) -> tuple[str, ...]:
    notes = [] if found is None else found.lines(finest)
    if not met:
        notes = ["nothing that was tried comes nearer to what was asked for", *notes]
    elif found is not None and choices.max_bytes is None and aims.missed_by(measured) > 0:
        notes = [f"short of what a pack aims at, {aims.text()}: nothing that was tried comes nearer", *notes]
    if finest.enhancer is not None:
        notes = [*notes, "the enhancer does not go into packs; the bundle has it"]
    return tuple(notes)


def reduced(avatar: Avatar, degree: int | None) -> Avatar:
    """`avatar` with the SH that it uses, at most of `degree`."""
    if degree is not None:
        avatar = replace(avatar, sh_degree=min(avatar.sh_degree, degree))
    return with_active_sh(avatar)


def _facts(
    played: Sequence[Avatar],
    heights: Sequence[int | None],
    measured: Sequence[Measured],
    choices: Choices,
    found: Found | None,
) -> dict[str, Any]:
    """What the document says besides the avatar."""
    finest = played[0]
    facts: dict[str, Any] = {
        "framing": framing(finest),
        "error": measured[0].as_json(),
        "levels": [
            {"error": one.as_json(), "height_px": height}
            for height, one in zip(heights, measured, strict=True)
        ],
        "packing": {
            "exact": choices.exact,
            "levels": list(choices.levels),
            "sh_degree": finest.sh_degree,
            "max_bytes": choices.max_bytes,
            "min_psnr": choices.min_psnr,
            **({} if found is None else {"search": found.record()}),
        },
    }
    facts["levels"][0].pop("error")  # stands in `error`
    if choices.handedness == "left":
        facts["framing"] = left_framing(facts["framing"])
    return facts | driving_facts(mirrored(finest) if choices.handedness == "left" else finest)


def _settings(choices: Choices, aims: Aims, found: Found | None) -> dict[str, str]:
    asked = aims.text()
    if choices.max_bytes is not None:
        asked = f"at most {choices.max_bytes} bytes"
    return {
        "Asked for": "float32 throughout" if choices.exact else asked,
        "SH degree": "as stored" if choices.sh_degree is None else f"at most {choices.sh_degree}",
        **({} if found is None else {"Found": "; ".join(found.lines(found.levels[0]))}),
    }
