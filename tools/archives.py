"""The players as a release holds them: an archive of what `assemble` puts together, with the same bytes every time."""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

from avatar_export.drop.steps import ADD_ON
from avatar_export.players.archive import tarball
from avatar_export.players.assemble import assemble
from avatar_schema.version import __version__

Files = Mapping[str, bytes]
BEGAN = (1980, 1, 1, 0, 0, 0)  # the earliest time that a .zip can say
TREE = "upm"  # a folder: Unity's Package Manager takes a git branch with these files "from git URL"


def zipped(files: Files, top: str) -> bytes:
    """A .zip with `files` below the folder `top`, in the order of their paths, without times."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in sorted(files.items()):
            entry = zipfile.ZipInfo(f"{top}/{path}", BEGAN)
            entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3  # made on Unix: rights follow
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, data)
    return out.getvalue()


# Player: the archive's name without version, how it ends, and how it is made. npm and Unity ask for a folder `package`.
ARCHIVES: Mapping[str, tuple[str, str, Callable[[Files], bytes]]] = {
    "unity": ("com.avatar-export.player", ".tgz", tarball),
    "unreal": ("GaussianAvatar", ".zip", lambda files: zipped(files, "GaussianAvatar")),
    "godot": ("godot-gaussian-avatar", ".zip", lambda files: zipped(files, ADD_ON)),
    "native": ("avatar-player", ".tar.gz", lambda files: tarball(files, f"avatar-player-{__version__}")),
    "web": ("avatar-export-player", ".tgz", tarball),
}


def write(out: Path) -> list[Path]:
    """Writes every archive and the tree for Unity into `out`, in place of earlier ones; returns the archives.

    Raises AvatarError where the npm package is not built.
    """
    written = []
    for player, (name, end, make) in ARCHIVES.items():
        files = assemble(player)
        for old in out.glob(f"{name}-*{end}"):
            old.unlink()
        written.append(out / f"{name}-{__version__}{end}")
        written[-1].write_bytes(make(files))
        if player == "unity":
            _write_tree(out / TREE, files)
    return written


def _write_tree(folder: Path, files: Files) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    for path, data in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(data)
