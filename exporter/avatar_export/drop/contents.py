"""What is put into a project: the player's files, and the avatar as a pack or a page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from avatar_export.conversion import Source as Read
from avatar_export.conversion import read_source
from avatar_export.convert_options import SourceOptions
from avatar_export.drop.hosts import Project
from avatar_export.drop.placing import Delivery
from avatar_export.notes.note import Note
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import pack_of
from avatar_export.players.archive import tarball
from avatar_export.players.assemble import assemble
from avatar_export.serving.session import identity
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.packs import FILE_LIMIT, decode_pack, is_pack


@dataclass(frozen=True)
class Source:
    """An avatar on the disk, and the options for it."""

    path: Path
    options: SourceOptions = field(default_factory=SourceOptions)

    @property
    def id(self) -> str:
        """The name of its files, from that of the avatar or of the source."""
        return identity(self.options.name or self.path.resolve().name.split(".")[0], ())

    def is_whole(self) -> bool:
        """Whether it is a pack that stays as it is. Raises AvatarError if nothing is there."""
        if not self.path.exists():
            raise AvatarError("no such file or folder", file=self.path)
        return is_pack(self.path) and self == Source(self.path)

    def read(self, progress: Callable[[str], None]) -> Read:
        """The avatar, with notes. Raises AvatarError as `read_source`."""
        return read_source(self.path, self.options, progress)

    def pack(self, choices: Choices, progress: Callable[[str], None]) -> tuple[bytes, list[Note]]:
        """The pack by these choices, and notes on it; a pack without further inputs as it is, whatever its frame.

        Raises AvatarError for an unsound source.
        """
        if self.is_whole():
            data = read_bytes(self.path, FILE_LIMIT)
            decode_pack(data, str(self.path))
            return data, []
        read = self.read(progress)
        made = pack_of(read.avatar, choices, progress)
        return made.file, [*read.clip_notes, *made.notes]


def player_files(project: Project) -> dict[str, bytes]:
    """The files of the project's player, if it has a player. Raises AvatarError if they were not installed."""
    if project.host.player is None:
        return {}
    try:
        return assemble(project.host.player)
    except FileNotFoundError as error:
        raise AvatarError(f"{error}; install avatar-export again", owner="avatar-export") from None


def asset_path(project: Project, source: Source) -> str:
    """Where the avatar's file goes, below the project."""
    folder = project.host.assets(project.folder)
    return "/".join(filter(None, (folder, f"{source.id}.avatar")))


def delivery(project: Project, player: dict[str, bytes], path: str, asset: bytes | None) -> Delivery:
    """All that goes into a project of an engine; `asset` is the file of the avatar at `path`, None for a plan alone."""
    host = project.host
    files: dict[str, bytes | None] = {path: asset}
    if host.tarball is not None:
        return Delivery("", {}, {host.tarball: tarball(player), **files}, host.moved)
    return Delivery("" if host.folder is None else host.folder(player), player, files, host.moved)
