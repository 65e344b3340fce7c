"""The table HOSTS: one row for each kind of project that takes an avatar, and how a folder is found to be one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from avatar_export.drop import steps, versions
from avatar_export.drop.versions import Files, Support
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import DEFAULT
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed

LEVELS = (1.0, 0.5, 0.25)  # parts of the Gaussians, for engines that run on phones and headsets too
MOST_BELOW = 200  # folders in which a project is looked for
MOST_NAMED = 3
PACK, PAGE = "pack", "page"  # what an avatar becomes


@dataclass(frozen=True)
class Host:
    """One kind of project."""

    name: str
    marks: tuple[str, ...]  # patterns of a file that each such project has
    version: Callable[[Path], str]  # of that file; "" where it does not say
    support: Callable[[Path, Files], Support]  # of that file, by the player's files
    steps: Callable[[steps.Place], steps.Steps]
    assets: Callable[[Path], str]  # folder for the avatar, below the project
    asset: str = PACK
    choices: Choices = DEFAULT  # of the pack
    player: str | None = None  # one of PLAYERS
    folder: Callable[[Files], str] | None = None  # of the player, which is replaced as a whole
    tarball: str | None = None  # or the player as one file
    moved: str = ""  # folder within which a user moves the avatar by the engine's own means
    other: Callable[[Path], bool] = lambda _: False  # whether that file belongs to something else


@dataclass(frozen=True)
class Project:
    """A folder that is the project of `host`."""

    host: Host
    folder: Path  # without links
    mark: Path

    def text(self) -> str:
        """`Unity 2022.3.20f1`."""
        return " ".join(filter(None, (self.host.name, self.host.version(self.mark))))


def _package_name(player: Files) -> str:
    return str(json.loads(player["package.json"])["name"])


def _served(project: Path) -> str:
    """The folder of an npm project whose files a web server has at its root, else the project itself."""
    return next((name for name in steps.SERVED if (project / name).is_dir()), "")


def _package_of_unity(mark: Path) -> bool:
    """Packages of Unity have a package.json, too, with the oldest version of Unity."""
    with suppress(AvatarError):
        return "unity" in versions.json_object(mark)
    return False


HOSTS = (
    Host(
        "Unity",
        ("ProjectSettings/ProjectVersion.txt",),
        versions.unity_version,
        versions.unity_support,
        steps.unity,
        lambda _: "Assets/Avatars",
        choices=Choices(levels=LEVELS, handedness="left"),
        player="unity",
        folder=lambda player: f"Packages/{_package_name(player)}",
        moved="Assets",
    ),
    Host(
        "Unreal",
        ("*.uproject",),
        versions.unreal_version,
        versions.unreal_support,
        steps.unreal,
        lambda _: "Avatars",  # beside Content, where only what was imported lies
        choices=Choices(levels=LEVELS),  # the plugin turns either frame into Unreal's
        player="unreal",
        folder=lambda _: "Plugins/GaussianAvatar",
    ),
    Host(
        "Godot",
        ("project.godot",),
        versions.godot_version,
        versions.godot_support,
        steps.godot,
        lambda _: "avatars",
        choices=Choices(levels=LEVELS),
        player="godot",
        folder=lambda _: steps.ADD_ON,
        moved=".",
    ),
    Host(
        "npm",
        ("package.json",),
        versions.npm_version,
        versions.npm_support,
        steps.npm,
        _served,
        player="web",
        tarball=steps.TARBALL,
        other=_package_of_unity,
    ),
    Host(
        "web",
        ("index.html", "*.html", "*.htm"),
        versions.web_version,
        versions.web_support,
        steps.web,
        lambda _: "",
        asset=PAGE,
    ),
)
LOOKED_FOR = ", ".join(
    f"{host.marks[-1] if host.asset == PAGE else host.marks[0]} ({host.name})" for host in HOSTS
)


def project_at(into: Path) -> Project:
    """The project that the folder `into` is.

    Raises AvatarError for another folder. The error names the project around it, or those directly below it.
    """
    if not into.exists():
        raise AvatarError("no such folder; give the folder of a project", file=into)
    folder = followed(into)
    found = _recognised(folder) if folder.is_dir() else None
    if found is not None:
        return found
    engines = [host for host in HOSTS if host.asset != PAGE]  # a page somewhere above says little
    around = next((project for above in folder.parents if (project := _recognised(above, engines))), None)
    if around is not None:
        inside = f"lies in the {around.host.name} project {around.folder}; give that folder"
        raise AvatarError(f"is not a project itself, but {inside}", file=into)
    below = [f"{one.folder} ({one.host.name})" for one in _below(folder)]
    if below:
        more = ", ..." if len(below) > MOST_NAMED else ""
        raise AvatarError(
            f"is not a project itself, but holds {', '.join(below[:MOST_NAMED])}{more}; give that folder",
            file=into,
        )
    raise AvatarError(f"is not a project of a known engine; looked for {LOOKED_FOR}", file=into)


def _recognised(folder: Path, hosts: Sequence[Host] = HOSTS) -> Project | None:
    """The first row that knows a file of the folder."""
    for host in hosts:
        for pattern in host.marks:
            for mark in sorted(folder.glob(pattern)):
                if mark.is_file() and not host.other(mark):
                    return Project(host, folder, mark)
    return None


def _below(folder: Path) -> Iterator[Project]:
    try:
        folders = sorted(one for one in folder.iterdir() if one.is_dir())[:MOST_BELOW]
    except OSError:  # a file, or a folder that nobody may list
        return
    yield from filter(None, map(_recognised, folders))
