"""READERS: one row for every system that can be read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from avatar_export.clips.sources import clips_from
from avatar_export.options import ReadOptions
from avatar_export.readers import asm, bundle, gaussian_avatars, lam
from avatar_export.readers.gaussian_blendshapes import reader as gaussian_blendshapes
from avatar_export.readers.psavatar import reader as psavatar
from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError


@dataclass(frozen=True)
class Reader:
    """How one system is recognised and read."""

    system: str
    about: str
    files: tuple[str, ...]
    detect: Callable[[Path], bool]  # by content, cheap; never raises on junk
    read: Callable[[Path, ReadOptions], Avatar]
    used_options: tuple[str, ...]  # fields of ReadOptions; any other is refused
    without_rig: ReadOptions  # what reads it when nothing lies beside it
    holds_clips: bool  # animations lie in the source itself


READERS = tuple(
    Reader(
        module.SYSTEM,
        (module.__doc__ or "").splitlines()[0],
        module.FILES,
        module.detect,
        module.read,
        module.USED_OPTIONS,
        module.WITHOUT_RIG,
        module is lam,
    )
    for module in (bundle, gaussian_blendshapes, splatting_avatar, gaussian_avatars, psavatar, lam, asm)
)


def read(path: Path, options: ReadOptions | None = None, system: str | None = None) -> Avatar:
    """The avatar at `path`, of the system that its content shows or that `system` forces; checked.

    Raises AvatarError where nothing is recognised, or by the reader.
    """
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    return read_with(find(path, system), path, options or ReadOptions())


def read_with(reader: Reader, path: Path, options: ReadOptions) -> Avatar:
    """The avatar that `reader` makes of `path`, with the clips that lie in it; checked."""
    avatar = reader.read(path, options)
    if reader.holds_clips:
        avatar = replace(avatar, clips=clips_from(avatar, path, optional=True))
    return avatar.check()


def find(path: Path, system: str | None = None) -> Reader:
    """The reader for `path`. Raises AvatarError naming what can be read."""
    known = ", ".join(reader.system for reader in READERS)
    if system is not None:
        for reader in READERS:
            if reader.system == system:
                return reader
        raise AvatarError(f"{system!r} is no system; there are {known}", field="--system")
    for reader in READERS:
        if reader.detect(path):
            return reader
    raise AvatarError(
        f"looks like none of {known}; `avatar-export systems` lists the files each has, --system forces one",
        file=path,
    )


def expect_bundle(path: Path) -> None:
    """Raise AvatarError that says what to do where `path` is a trained avatar and not a bundle."""
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    if bundle.detect(path):
        return
    for reader in READERS:
        if reader.detect(path):
            raise AvatarError(
                f"is a trained {reader.system} avatar, no bundle; run `avatar-export convert` on it first",
                file=path,
            )
