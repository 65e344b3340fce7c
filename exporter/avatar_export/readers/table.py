"""The table READERS: one row for each system that can be read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from avatar_export.fit.whole import whole_fit
from avatar_export.formats.archive import TRUNCATED, is_truncated
from avatar_export.notes.note import Note
from avatar_export.notes.text import stored
from avatar_export.options import ReadOptions
from avatar_export.readers import asm, bundle, gaussian_avatars, lam, lhm
from avatar_export.readers.gaussian_blendshapes import reader as gaussian_blendshapes
from avatar_export.readers.psavatar import reader as psavatar
from avatar_export.readers.rgbavatar import reader as rgbavatar
from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks import arguments
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError

MOST_LOOKED_AT = 200  # entries of a folder that is not an avatar itself
MOST_NAMED = 4


@dataclass(frozen=True)
class Reader:
    """How one system is recognised and read."""

    system: str
    about: str
    files: tuple[str, ...]
    detect: Callable[[Path], bool]  # by content, fast; never raises
    read: Callable[[Path, ReadOptions], Avatar]  # `notes` of its provenance are Notes
    used_options: tuple[str, ...]  # fields of ReadOptions; any other is refused
    without_rig: ReadOptions  # options with which it reads the checkpoint alone


READERS = tuple(
    Reader(
        module.SYSTEM,
        (module.__doc__ or "").splitlines()[0],
        module.FILES,
        module.detect,
        module.read,
        module.USED_OPTIONS,
        module.WITHOUT_RIG,
    )
    for module in (
        bundle,
        gaussian_blendshapes,
        splatting_avatar,
        gaussian_avatars,
        psavatar,
        lam,
        rgbavatar,
        lhm,
        asm,
    )
)


def read(path: str | Path, options: ReadOptions | None = None, system: str | None = None) -> Avatar:
    """The trained avatar or bundle at `path`, checked; right-handed, +Y up, metres.

    `options` are inputs that the checkpoint does not hold. The system is detected by content, or is `system`, one of
    the names in READERS. Raises AvatarError for a path or system that does not exist, for files that no reader
    recognises, and for unsound data; TypeError for arguments of other types.
    """
    path = arguments.path("path", path)
    options = ReadOptions() if options is None else arguments.instance("options", options, ReadOptions)
    if system is not None:
        arguments.instance("system", system, str, "a text")
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    return read_with(find(path, system), path, options)[0]


def read_with(reader: Reader, path: Path, options: ReadOptions) -> tuple[Avatar, tuple[Note, ...]]:
    """The avatar that `reader` makes of `path`, checked, and what is said of it. Raises AvatarError."""
    avatar = check_avatar(reader.read(path, options))
    given = avatar.provenance.get("notes")
    notes = tuple(one for one in (given if isinstance(given, list) else ()) if isinstance(one, Note))
    if reader.system != bundle.SYSTEM:  # what was said of a bundle when it was made stands in it
        accept = options.accept_misfit or "accept_misfit" not in reader.used_options
        notes += tuple(whole_fit(avatar, accept, reader.system, path))
    if notes:
        avatar = replace(avatar, provenance={**avatar.provenance, "notes": stored(notes)})
    return avatar, notes


def find(path: Path, system: str | None = None) -> Reader:
    """The reader of `system`, else the first that recognises `path`.

    Raises AvatarError as `detected`, and if no reader recognises it; the error names the subfolders that a reader
    recognises, or says that a zip is truncated.
    """
    known = ", ".join(reader.system for reader in READERS)
    if system is not None:
        for reader in READERS:
            if reader.system == system:
                return reader
        raise AvatarError(f"unknown system {system!r}; there are {known}", field="--system")
    found = detected(path)
    if found is not None:
        return found
    if is_truncated(path):
        raise AvatarError(TRUNCATED, file=path)
    inside = _recognised_inside(path)
    if inside:
        raise AvatarError(
            f"is not itself an avatar, but holds {' and '.join(inside)}; pass that path", file=path
        )
    raise AvatarError(
        f"is not recognised as any of {known}; `avatar-export systems` lists the files of each, --system chooses one",
        file=path,
    )


def detected(path: Path) -> Reader | None:
    """The first reader that recognises `path`. Raises AvatarError for what may not be read."""
    try:
        return next((reader for reader in READERS if reader.detect(path)), None)
    except OSError as error:
        raise AvatarError(
            f"cannot be read ({error.strerror or error})", file=error.filename or path
        ) from None


def _recognised_inside(folder: Path) -> list[str]:
    """`FOLDER/NAME (SYSTEM)` for the first entries of a folder that a reader recognises; none for a file.

    Raises AvatarError if none is recognised and one may not be read.
    """
    try:
        entries = sorted(folder.iterdir())[:MOST_LOOKED_AT] if folder.is_dir() else []
    except OSError:
        entries = []
    found, unread = [], None
    for entry in entries:
        try:
            reader = detected(entry)
            found += [] if reader is None else [f"{entry} ({reader.system})"]
        except AvatarError as error:
            unread = unread or error
    if unread is not None and not found:
        raise unread
    return found[:MOST_NAMED]


def expect_bundle(path: Path) -> None:
    """Raise AvatarError if `path` does not exist, or is a trained avatar that must be converted first."""
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    if bundle.detect(path):
        return
    if is_truncated(path):
        raise AvatarError(TRUNCATED, file=path)
    reader = detected(path)
    if reader is not None:
        raise AvatarError(
            f"is a trained {reader.system} avatar, not a bundle; run `avatar-export convert` on it first",
            file=path,
        )
