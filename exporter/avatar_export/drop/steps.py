"""What a person does next in an engine, in the words of its own menus: three steps at most."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import NamedTuple

TARBALL = "avatar-export-player.tgz"
ADD_ON = "addons/gaussian_avatar"  # of Godot
ADD = {  # file of a package manager: its command that takes a tarball
    "pnpm-lock.yaml": "pnpm add",
    "yarn.lock": "yarn add",
    "bun.lock": "bun add",
    "bun.lockb": "bun add",
}
SERVED = ("public", "static")  # folders whose files a web server has at its root

Steps = tuple[str, ...]


class Place(NamedTuple):
    """Where things were put."""

    project: Path
    mark: Path  # the file by which the project was recognised
    asset: str  # pack or page, below the project


def unity(place: Place) -> Steps:
    """Nothing to add: Unity finds packages in Packages by itself."""
    return (
        "Open the project in Unity. Tools > Gaussian Avatar > Check Project says in the Console whether its settings "
        "suit avatars.",
        f"Drag {place.asset} from the Project window into the Scene view, and press F with the pointer there.",
        "Select it. In the Inspector, component Gaussian Avatar, pull a slider under Expressions.",
    )


def unreal(place: Place) -> Steps:
    """A plugin of sources: a project without C++ gets its first class before the plugin is built."""
    compiler = "This needs a C++ toolchain: Visual Studio, Xcode, or Unreal's clang on Linux."
    if any((place.project / "Source").glob("*.Target.cs")):
        first = f"Open {place.mark.name} and answer Yes when it asks to build the missing modules. {compiler}"
    else:
        first = (
            "Make the project a C++ project, which builds the plugin too: Tools > New C++ Class... > None > Create "
            f"Class (if {place.mark.name} does not open, move Plugins/GaussianAvatar away meanwhile). {compiler}"
        )
    return (
        first,
        f"Content Browser > Import > {place.asset}. Where it was imported before: right-click the asset > Reimport.",
        "Select an actor. Details > Add > Gaussian Avatar, and choose the asset under Avatar.",
    )


def godot(place: Place) -> Steps:
    """No file of the user is edited, so an add-on is switched on by hand; the import of a pack is automatic then."""
    return (
        "Open the project in Godot. Project > Project Settings > Plugins: switch on Gaussian Avatar Player.",
        f"Drag {place.asset} from the FileSystem dock into the 3D view.",
        "Select it. In the Inspector, pull a slider under Expressions.",
    )


def npm(place: Place) -> Steps:
    """The line to run: package.json is not edited."""
    add = next((add for file, add in ADD.items() if (place.project / file).exists()), "npm install")
    folder, *rest = PurePosixPath(place.asset).parts
    served = "/" + "/".join(rest) if folder in SERVED else f"./{place.asset}"
    return (
        f"In {place.project}: {add} ./{TARBALL}",
        'In your script: import "avatar-export-player/element"; in your page: '
        f'<gaussian-avatar src="{served}" camera-controls></gaussian-avatar>',
        "README.md in node_modules/avatar-export-player shows React, three.js, Babylon.js, PlayCanvas, too.",
    )


def web(place: Place) -> Steps:
    """Pages that are opened from a disk may load nothing, so it is looked at through a server."""
    return (
        f"Look at it: python -m http.server --directory {place.project}, then http://localhost:8000/{place.asset}",
        f'In your page: <iframe src="{place.asset}" width="640" height="640" allow="fullscreen"></iframe>',
        "Copy the folder to your web server or file host.",
    )
