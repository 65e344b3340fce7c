"""One avatar that is shown: where its file lies, and its newest sound pack."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from avatar_export.conversion import read_source
from avatar_export.convert_options import SourceOptions
from avatar_export.notes.note import Note
from avatar_export.packing.make import pack_of
from avatar_export.serving.session import Shown, identity, shown
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.packs import FILE_LIMIT, is_pack

MOST_FILES = 2000  # of a folder that are watched
Progress = Callable[[str], None]
Stamp = tuple[tuple[str, int, int], ...]  # (path, time of the last change in ns, bytes) of each file


@dataclass(frozen=True)
class Source:
    """An avatar on the disk: a pack, or what is packed when it is loaded."""

    id: str
    path: Path

    def load(
        self,
        progress: Progress = lambda _: None,
        clips: Sequence[Path] = (),
        noted: Callable[[Note], None] = lambda _: None,
    ) -> Shown:
        """Its pack. Another file, and a pack to which `clips` are added, is packed by the default choices.

        `noted` is called with what those clips move and the avatar lacks. Raises AvatarError for an unsound source.
        """
        if self.is_whole() and not clips:
            return shown(self.id, read_bytes(self.path, FILE_LIMIT), str(self.path))
        progress(f"packing {self.path}")
        read = read_source(self.path, SourceOptions(clips=tuple(clips)), lambda _: None)
        made = pack_of(read.avatar)
        for note in (*read.clip_notes, *(one for one in made.notes if one.doubtful)):
            noted(Note("of_avatar", {"avatar": read.avatar.name, "what": note}, note.severity))
        return shown(self.id, made.file, str(self.path))

    def is_whole(self) -> bool:
        """Whether it is a pack already. Raises AvatarError if nothing is there."""
        if not self.path.exists():
            raise AvatarError("no such file or folder", file=self.path)
        return is_pack(self.path)

    def stamp(self) -> Stamp:
        """What changes when its files change; () without files."""
        try:
            files = [self.path] if self.path.is_file() else sorted(self.path.rglob("*"))[:MOST_FILES]
            stats = [(str(file), file.stat()) for file in files]
        except OSError:  # it is being replaced
            return ()
        return tuple((name, stat.st_mtime_ns, stat.st_size) for name, stat in stats)


def sources_of(paths: Sequence[Path], taken: Sequence[str] = ()) -> list[Source]:
    """One source each, with ids of their own and not among those `taken`."""
    found: list[Source] = []
    for path in paths:
        own = identity(path.resolve().name.split(".")[0], {*taken, *(source.id for source in found)})
        found.append(Source(own, path))
    return found
