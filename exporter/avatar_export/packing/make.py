"""An avatar in, `NAME.avatar` out: the whole of `avatar-export pack` as one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from avatar_export.levels import coarser, served
from avatar_export.measure.claims import claim_poses, search_poses
from avatar_export.measure.framing import framing, left_framing, preview_webp
from avatar_export.measure.report import report_html
from avatar_export.measure.views import NamedView, Shot, in_turn, views
from avatar_export.measure.yardstick import Measured, Yardstick, compare
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.notes.text import text
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.budget import by_part, coarsest, floor, refuse_below
from avatar_export.packing.choices import Choices
from avatar_export.packing.reference import reference_folder, reference_of, refuse_folder, write_folder
from avatar_export.packing.search import Aims, Found, aims_of, by_aims, by_size
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import Packing, Prepared, driving_facts, prepare, write
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import default_backend
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.ownership import of_file
from avatar_runtime.io.text_files import refuse_existing, write_bytes, write_text
from avatar_runtime.packs import decode_pack, placed
from avatar_runtime.player import ABSURD
from avatar_runtime.program.check import check_program

SIZE = 512  # pixels of the images that are compared
SEEN = 4  # of so many poses of a claim one sets the camera
DRAWS = 2  # claims that are measured, each in other poses: where one is short of the aims, steps become finer once
# Below these, people see that a pack is not its source: the limits of levels for an image and for a block of it.
POOR = Aims(40.0, 30.0)
FIGURES = 1500  # bytes that the measured figures of a level take in the file, at most


DEFAULT = Choices()
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Attempt:
    """Levels as a pack has them, measured against the source in poses that the search did not see."""

    found: Found | None  # None: float32 throughout
    levels: tuple[Avatar, ...]  # before they were rounded
    prepared: Prepared
    played: tuple[Avatar, ...]  # in the right-handed frame
    shots: Sequence[Shot]
    measured: tuple[Measured, ...]


@dataclass(frozen=True)
class Made:
    """A pack that was made, with its figures."""

    file: bytes
    parts: Mapping[str, int]  # bytes in the file, by part
    attempt: Attempt
    met: bool  # whether the budget was met
    notes: tuple[Note, ...]
    document: Mapping[str, Any]
    settings: Mapping[str, str]  # what was asked for and found, for people

    @property
    def measured(self) -> tuple[Measured, ...]:
        """Each level against the source."""
        return self.attempt.measured

    @property
    def counts(self) -> tuple[int, ...]:
        """Gaussians of each level."""
        return tuple(level.gaussians.count for level in self.attempt.played)


def make_pack(
    source: Avatar,
    out: Path,
    choices: Choices = DEFAULT,
    *,
    report: Path | None = None,
    reference: bool = False,
    force: bool = False,
    progress: Progress = lambda _: None,
) -> Made:
    """Write `source` as a pack to the file `out`, the page `report`, and with `reference` the folder beside it.

    `progress` is called with what is done next. Raises AvatarError as `pack_of`, and if a file exists without `force`.
    On failure nothing is changed.
    """
    for path in (out, report):
        if path is not None:
            refuse_existing(path, force)
    if reference:
        refuse_folder(reference_folder(out), force)
    made = pack_of(source, choices, progress)
    page, files = None, None
    if report is not None:
        progress("drawing the report")
        page = _report(source, made)
    if reference:
        progress("computing the reference")
        files = ABSURD(reference_of)(made.attempt.prepared.levels[0], choices.handedness, made.file)
    decode_pack(made.file, str(out))  # nothing is written that readers refuse
    write_bytes(out, made.file, force=force)
    if files is not None:
        write_folder(reference_folder(out), files, force=force)
    if report is not None and page is not None:
        write_text(report, page, force=force)
    return made


@ABSURD
def pack_of(source: Avatar, choices: Choices = DEFAULT, progress: Progress = lambda _: None) -> Made:
    """`source` as a pack. Raises AvatarError for an unsound avatar, and for a part that no buffer can hold."""
    source = replace(source, packed=None)
    finest = reduced(source, choices.sh_degree)
    packer = _Packer(choices, preview_webp(finest) if choices.preview else None)
    notes = _floor(finest, packer, progress)  # before anything that takes minutes
    levels, left_out = _levels(finest, choices, progress)
    aims, cameras = aims_of(source, choices.min_psnr), _cameras(source)
    found = None
    if not choices.exact:
        progress("searching the steps")
        found = _searched(source, levels, aims, cameras, packer)
    attempt = _measured(source, levels, found, aims, cameras, packer, progress)
    attempt, heights, lost = _worthwhile(attempt, packer)
    _refuse_unsound(attempt.prepared, source.name)
    facts = _facts(attempt, heights, choices)
    packing = write(attempt.prepared, facts, packer.preview, choices.handedness)
    met = _met(packing, attempt.measured[0], choices)
    notes += [*left_out, *lost, *_notes(source, finest, choices, aims, attempt, met)]
    settings = _settings(choices, aims, attempt.found)
    return Made(packing.file, by_part(packing), attempt, met, tuple(notes), facts, settings)


class _Packer:
    """Prepares and writes packs by a user's choices, in the frame that was asked for."""

    def __init__(self, choices: Choices, preview: bytes | None) -> None:
        self.choices, self.preview = choices, preview

    def prepare(self, levels: Sequence[Avatar], fine: Fineness | None) -> Prepared:
        """The levels, in the pack's frame."""
        left = self.choices.handedness == "left"
        return prepare([mirrored(level) for level in levels] if left else levels, fine)

    def right(self, prepared: Prepared) -> tuple[Avatar, ...]:
        """The levels of the pack in the right-handed frame, in which they are measured."""
        left = self.choices.handedness == "left"
        return tuple(placed(mirrored(level) if left else level) for level in prepared.levels)

    def packed(self, levels: Sequence[Avatar], fine: Fineness) -> Packing:
        """The file, without figures."""
        return write(self.prepare(levels, fine), None, self.preview, self.choices.handedness)

    def size(self, levels: Sequence[Avatar], fine: Fineness) -> int:
        """Bytes of the file with its figures."""
        return len(self.packed(levels, fine).file) + FIGURES * (1 + len(levels))


def _floor(finest: Avatar, packer: _Packer, progress: Progress) -> list[Note]:
    """What no step makes smaller, where a size is asked for. Raises AvatarError for a size below it."""
    if packer.choices.max_bytes is None:
        return []
    least = floor(packer.packed(*coarsest([finest])))
    refuse_below(least, packer.choices.max_bytes)
    progress(text(least.note()))
    return [least.note()]


def _levels(avatar: Avatar, choices: Choices, progress: Progress) -> tuple[list[Avatar], tuple[Note, ...]]:
    """The levels that are worth their bytes, and notes on the others."""
    levels = [avatar]
    for part in choices.levels[1:]:
        progress(f"merging to {part:g} of the Gaussians")
        levels.append(coarser(avatar, part))
    shown = served(levels)
    return [levels[index] for index in shown.kept], shown.notes


def _cameras(source: Avatar) -> Sequence[NamedView]:
    return views(source, SIZE, [*search_poses(source), *claim_poses(source)[::SEEN]])


def _searched(
    source: Avatar, levels: Sequence[Avatar], aims: Aims, cameras: Sequence[NamedView], packer: _Packer
) -> Found:
    """The steps that keep to the size or the aims."""
    yardstick = Yardstick(source, in_turn(search_poses(source), cameras), default_backend())
    choices = packer.choices
    if choices.max_bytes is not None:
        return by_size(levels, choices.max_bytes, yardstick, packer.size, coarser)
    # By default an avatar that is better at the usual steps stays so: little would be saved by losing it.
    return by_aims(levels, aims, yardstick, *([] if choices.min_psnr else [0.0]))


def _measured(
    source: Avatar,
    levels: Sequence[Avatar],
    found: Found | None,
    aims: Aims,
    cameras: Sequence[NamedView],
    packer: _Packer,
    progress: Progress,
) -> Attempt:
    """The levels by the steps that were found, or by finer ones where these are short of the aims in other poses."""
    for draw in range(DRAWS):
        progress("packing")
        given, fine = (levels, None) if found is None else (found.levels, found.fine)
        prepared = packer.prepare(given, fine)
        played = packer.right(prepared)
        progress("measuring")
        shots = in_turn(claim_poses(source, draw), cameras)
        allowance = 0.0 if found is None else aims.allowance
        compared = compare(source, played, shots, default_backend())
        measured = tuple(replace(one, allowance=allowance) for one in compared)
        attempt = Attempt(found, tuple(given), prepared, played, shots, measured)
        missing = aims.missed_by(measured[0])
        if found is None or packer.choices.max_bytes is not None or missing <= 0 or found.finest:
            break
        found = found.finer(missing)
    return attempt


def _worthwhile(
    attempt: Attempt, packer: _Packer
) -> tuple[Attempt, tuple[int | None, ...], tuple[Note, ...]]:
    """(the levels that are still worth their bytes when they are rounded, their heights, notes on the others)."""
    shown = served(attempt.played)
    if not shown.notes:
        return attempt, shown.heights, ()
    levels = tuple(attempt.levels[index] for index in shown.kept)
    prepared = packer.prepare(levels, None if attempt.found is None else attempt.found.fine)
    measured = tuple(attempt.measured[index] for index in shown.kept)
    kept = replace(
        attempt, levels=levels, prepared=prepared, played=packer.right(prepared), measured=measured
    )
    return kept, shown.heights, shown.notes


def _refuse_unsound(prepared: Prepared, name: str) -> None:
    """Raise AvatarError for numbers that no reader of the pack would take."""
    with of_file(name):
        check_program(prepared.program, min(len(level.groups) for level in prepared.levels))
        for level in prepared.levels:
            check_avatar(level)


def _met(packing: Packing, measured: Measured, choices: Choices) -> bool:
    """Whether the file keeps to what was asked for."""
    if choices.max_bytes is not None:
        return len(packing.file) <= choices.max_bytes
    return choices.min_psnr is None or measured.mean >= choices.min_psnr


def _notes(
    source: Avatar, finest: Avatar, choices: Choices, aims: Aims, attempt: Attempt, met: bool
) -> list[Note]:
    found = attempt.found
    notes = [] if found is None else found.notes(finest)
    if not met:
        notes = [fact("nothing_nearer"), *notes]
    elif found is not None and choices.max_bytes is None and aims.missed_by(attempt.measured[0]) > 0:
        notes = [fact("short_of_aims", aims=aims.text()), *notes]
    if POOR.missed_by(attempt.measured[0]) > 0:
        notes = [_poor(source, finest, choices, attempt.measured[0]), *notes]
    return [*notes, *([] if finest.enhancer is None else [fact("no_enhancer")])]


def _poor(source: Avatar, finest: Avatar, choices: Choices, measured: Measured) -> Note:
    """A doubt with the option that gives a better picture."""
    cure = "exact"
    if choices.max_bytes is not None:
        cure = "max_bytes"
    elif choices.sh_degree is not None and finest.sh_degree < source.sh_degree:
        cure = "sh_degree"
    elif choices.min_psnr is not None:
        cure = "min_psnr"
    figures = {"mean": measured.mean, "worst": measured.worst, "region": measured.region}
    return doubt("poor_picture", **figures, cure=cure, least=POOR.mean, lowest=POOR.worst)


def reduced(avatar: Avatar, degree: int | None) -> Avatar:
    """`avatar` with the SH that it uses, at most of `degree`."""
    if degree is not None:
        avatar = replace(avatar, sh_degree=min(avatar.sh_degree, degree))
    return with_active_sh(avatar)


def _facts(attempt: Attempt, heights: Sequence[int | None], choices: Choices) -> dict[str, Any]:
    """What the document says besides the avatar."""
    finest, measured, found = attempt.played[0], attempt.measured, attempt.found
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
        **({} if found is None else {"Found": "; ".join(map(text, found.notes(found.levels[0])))}),
    }


def _report(source: Avatar, made: Made) -> str:
    attempt = made.attempt
    return report_html(
        replace(source, packed=None), attempt.played[0], attempt.shots, attempt.measured[0], made.parts,
        title=source.name, facts=made.settings,
    )  # fmt: skip
