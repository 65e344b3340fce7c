"""Gaussians in the folders of 3DGS and trainers derived from it: RUN/point_cloud/iteration_N/point_cloud.ply."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from avatar_export.notes.note import Note
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.io.whole_files import read_bytes

NAME = "point_cloud.ply"
ITERATION = re.compile(r"iteration_[0-9]{1,12}")
MAX_PLY_BYTES = 2 << 30


@dataclass(frozen=True)
class PointCloud:
    """A .ply of Gaussians and the folders of its run, nearest first: iteration_N, point_cloud, RUN."""

    file: Path
    folders: tuple[Path, ...]  # in another layout only the folder of the .ply

    @property
    def name(self) -> str:
        """The default name of the avatar."""
        return self.folders[-1].absolute().name or self.file.stem

    def find(self, name: str) -> Path | None:
        """The file `name` next to the .ply, else further up in its run, if there is one."""
        return first_file(folder / name for folder in self.folders)


def locate(path: Path, complete: Callable[[PointCloud], bool] = lambda _: True) -> PointCloud | None:
    """The Gaussians of a run folder (its newest iteration), of an iteration's folder, or of a .ply; never raises.

    Those that are not `complete` are passed over."""
    if os.path.isfile(path):
        folders = [path] if path.suffix.lower() == ".ply" else []
    else:
        folders = [folder / NAME for folder in (path, *_iterations(path / "point_cloud"))]
    found = (_point_cloud(file) for file in folders if os.path.isfile(file))
    return next((cloud for cloud in found if complete(cloud)), None)


def taken_iteration(path: Path, cloud: PointCloud, needed: str) -> list[Note]:
    """A note on the iteration `cloud` of the run `path`, and on those passed over; none for one .ply.

    Raises AvatarError if the run has a newer iteration, which lacks what is `needed` then.
    """
    if len(cloud.folders) == 1:
        return []
    folder, here = cloud.file.parent, cloud.file.absolute().parent
    newest = next(iter(_iterations(path / "point_cloud")), folder)
    if newest.name != folder.name and folder != path:
        raise AvatarError(
            f"{newest.name} is incomplete: it needs {needed}; the newest complete one is {folder.name}: pass {folder}, "
            "or wait until the training has written all",
            file=path,
        )
    others = [other.name for other in _iterations(here.parent) if other.name != here.name]
    values = {"what": here.name, "others": [] if path.absolute() == here else others}
    return [Note("taken", values, passing=True)]


def first_file(paths: Iterable[Path]) -> Path | None:
    """The first path that is a file, if there is one. Paths that cannot be accessed are skipped."""
    return next((path for path in paths if os.path.isfile(path)), None)


def has_property(cloud: PointCloud, name: str) -> bool:
    """Whether the header of the .ply has the property `name`; never raises."""
    try:
        with open_file(cloud.file) as file:
            head = file.read(ply.MAX_HEADER_BYTES)
    except OSError:
        return False
    header, end, _ = head.partition(b"\nend_header")
    return bool(end) and re.search(rb"\nproperty \w+ " + name.encode() + rb"\r?(\n|$)", header) is not None


def read_ply(cloud: PointCloud) -> ply.Ply:
    """The rows of the .ply. Raises AvatarError for a file that cannot be read or is not a .ply."""
    return ply.decode(read_bytes(cloud.file, MAX_PLY_BYTES), cloud.file)


def _iterations(folder: Path) -> list[Path]:
    """The folders iteration_N, newest first."""
    try:
        names = [name for name in os.listdir(folder) if ITERATION.fullmatch(name)]
    except (OSError, ValueError):
        return []
    names.sort(key=lambda name: int(name.removeprefix("iteration_")), reverse=True)
    return [folder / name for name in names]


def _point_cloud(file: Path) -> PointCloud:
    iteration = file.absolute().parent
    if ITERATION.fullmatch(iteration.name) and iteration.parent.name == "point_cloud":
        return PointCloud(file, (file.parent, iteration.parent, iteration.parent.parent))
    return PointCloud(file, (file.parent,))
