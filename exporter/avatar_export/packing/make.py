"""An avatar in, `NAME.avatar` out: the whole of `avatar-export pack` as one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from avatar_export.levels import coarser, served
from avatar_export.measure.framing import framing, left_framing, preview_webp
from avatar_export.measure.poses import poses
from avatar_export.measure.report import report_html
from avatar_export.measure.views import views
from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.reference import reference_folder, reference_of, refuse_folder, write_folder
from avatar_export.packing.search import Found, Target, search
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import Packing, Prepared, driving_facts, prepare, write
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import default_backend
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.text_files import refuse_existing, write_bytes, write_text
from avatar_runtime.packs import decode_pack, placed
from avatar_runtime.player import ABSURD

SIZE = 512  # pixels of the images that are compared
FIGURES = 900  # bytes that the measured figures of a level take in the file, at most


@dataclass(frozen=True)
class Choices:
    """What a user asks of a pack."""

    exact: bool = False  # float32 throughout
    max_bytes: int | None = None
    min_psnr: float | None = None  # dB inside the mask
    levels: tuple[float, ...] = (1.0,)  # parts of the Gaussians, finest first
    sh_degree: int | None = None
    handedness: str = "right"
    preview: bool = True


DEFAULT = Choices()


@dataclass(frozen=True)
class Made:
    """A pack that was made, with its figures."""

    file: bytes
    parts: Mapping[str, int]  # bytes in the file, by part
    measured: tuple[Measured, ...]  # each level against the source
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
    progress("drawing the source")
    source = replace(source, packed=None)
    shown = poses(source)
    yardstick = Yardstick(source, shown, views(source, SIZE, shown), default_backend())
    levels, left_out = _levels(reduced(source, choices.sh_degree), choices, progress)
    packer = _Packer(choices, preview_webp(levels[0]) if choices.preview else None)
    fine, found = None if choices.exact else Fineness(), None
    if choices.max_bytes is not None or choices.min_psnr is not None:
        progress("searching the steps")
        target = Target(choices.max_bytes, choices.min_psnr)
        found = search(levels, target, yardstick, packer.tried, coarser)
        levels, fine = list(found.levels), found.fine
    progress("packing")
    prepared = packer.prepare(levels, fine)
    played = [packer.right(level) for level in prepared.levels]
    progress("measuring")
    served_by = served(played)
    if served_by.notes:  # rounding took what made a level worth its bytes
        left_out += served_by.notes
        prepared = packer.prepare([levels[index] for index in served_by.kept], fine)
        played = [packer.right(level) for level in prepared.levels]
    measured = tuple(yardstick.measure(level) for level in played)
    facts = _facts(played, served_by.heights, measured, choices, found)
    packing = write(prepared, facts, packer.preview, choices.handedness)
    decode_pack(packing.file, str(out))  # numbers that no reader takes are refused before they are written
    parts = by_part(packing)
    page = None
    if report is not None:
        progress("drawing the report")
        page = report_html(
            yardstick, played[0], measured[0], parts, title=source.name, facts=_settings(choices, found)
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
    return Made(
        packing.file,
        parts,
        measured,
        counts,
        _met(packing, measured[0], choices),
        (*left_out, *_notes(source, found)),
        facts,
    )


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

    def tried(self, levels: Sequence[Avatar], fine: Fineness) -> tuple[Avatar, int]:
        """(the finest level as it will play, bytes of the file with its figures)."""
        prepared = self.prepare(levels, fine)
        packing = write(prepared, None, self.preview, self.choices.handedness)
        return self.right(prepared.levels[0]), len(packing.file) + FIGURES * (1 + len(levels))


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


def _met(packing: Packing, measured: Measured, choices: Choices) -> bool:
    """Whether the file that was written meets the budget."""
    if choices.max_bytes is not None:
        return len(packing.file) <= choices.max_bytes
    if choices.min_psnr is not None:
        inside = measured.psnr if measured.psnr_inside is None else measured.psnr_inside
        return inside >= choices.min_psnr
    return True


def _notes(source: Avatar, found: Found | None) -> tuple[str, ...]:
    notes = () if found is None else found.lines
    if source.enhancer is not None:
        notes = (*notes, "the enhancer does not go into packs; the bundle has it")
    return notes


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
            **({} if found is None else {"search": found.record}),
        },
    }
    facts["levels"][0].pop("error")  # stands in `error`
    if choices.handedness == "left":
        facts["framing"] = left_framing(facts["framing"])
    return facts | driving_facts(mirrored(finest) if choices.handedness == "left" else finest)


def _settings(choices: Choices, found: Found | None) -> dict[str, str]:
    asked = "nothing: the default steps"
    if choices.max_bytes is not None:
        asked = f"at most {choices.max_bytes} bytes"
    elif choices.min_psnr is not None:
        asked = f"at least {choices.min_psnr:g} dB inside the outline"
    return {
        "Asked for": "float32 throughout" if choices.exact else asked,
        "SH degree": "as stored" if choices.sh_degree is None else f"at most {choices.sh_degree}",
        **({} if found is None else {"Found": "; ".join(found.lines)}),
    }


PARTS = {  # the first part of a tensor's name -> what a person calls it
    "document": "Names, passes and figures",
    "preview": "Preview",
    "rig": "Skeleton and triangles",
    "MorphStatic": "Mesh and its morphs",
    "SkinStatic": "Skin weights of the mesh",
    "SurfaceStatic": "Triangles under the Gaussians",
    "BlendStatic": "Gaussians and their expressions",
    "BindStatic": "Skin weights of the Gaussians",
    "EmbedStatic": "Places of the Gaussians on the mesh",
    "clips": "Clips",
}


def by_part(packing: Packing) -> dict[str, int]:
    """Bytes in the file by part, the largest first; levels below the finest are parts of their own."""
    found: dict[str, int] = {}
    for tensor, size in packing.sizes.items():
        level, slash, rest = tensor.partition("/")
        coarse = level if slash and level.startswith("level") else ""
        first = (rest if coarse else tensor).partition("/")[0].partition(".")[0]
        name = PARTS.get(first, first) + (f", {coarse}" if coarse else "")
        found[name] = found.get(name, 0) + size
    return dict(sorted(found.items(), key=lambda item: -item[1]))
