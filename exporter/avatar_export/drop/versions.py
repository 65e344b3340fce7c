"""Which version an engine's project has, and whether the player supports it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

Files = Mapping[str, bytes]  # of a player, put together
LARGEST = 4 << 20  # bytes of a project's file
NEWEST_UNITY = "6000"  # Unity 6 calls itself 6000.x; the oldest stands in the package
UNREAL = ("5.4", "5.8")  # oldest, newest
NUMBER = re.compile(r"\d{1,6}")


class Support(NamedTuple):
    """Whether the player supports a version; None: nobody knows."""

    known: bool | None
    text: str


def unity_version(mark: Path) -> str:
    """From `m_EditorVersion: 2022.3.20f1`. Raises AvatarError if the file has no such line."""
    found = re.search(r"^m_EditorVersion:[ \t]*(\S+)", _text(mark), re.MULTILINE)
    if found is None:
        raise AvatarError(
            "has no such line; open the project in Unity once", file=mark, field="m_EditorVersion"
        )
    return found[1]


def unreal_version(mark: Path) -> str:
    """From `"EngineAssociation": "5.4"`; "" where that is empty or the name of an engine that was built on a machine.

    Raises AvatarError for a file that holds no JSON object.
    """
    said = str(json_object(mark).get("EngineAssociation", ""))
    return said if re.fullmatch(r"\d+\.\d+(\.\d+)?", said) else ""


def godot_version(mark: Path) -> str:
    """From `config/features=PackedStringArray("4.6", "Forward Plus")`; "" where that says none."""
    found = re.search(r'^config/features=[^\n]*?"(\d+\.\d+)', _text(mark), re.MULTILINE)
    return "" if found is None else found[1]


def npm_version(mark: Path) -> str:
    """Name and version of a package. Raises AvatarError for a file that holds no JSON object."""
    said = json_object(mark)
    return " ".join(["package", *(str(said[key]) for key in ("name", "version") if key in said)])


def web_version(mark: Path) -> str:
    """The page by which the folder was recognised."""
    return f"folder with {mark.name}"


def unity_support(mark: Path, player: Files) -> Support:
    """By the oldest version in the package's own package.json."""
    least = str(json.loads(player["package.json"])["unity"])
    return _between(unity_version(mark), least, NEWEST_UNITY, f"{least} to 6.x")


def unreal_support(mark: Path, _player: Files) -> Support:
    """By UNREAL."""
    return _between(unreal_version(mark), *UNREAL, " to ".join(UNREAL))


def godot_support(mark: Path, player: Files) -> Support:
    """By the oldest version in the extension's own description, and by the renderer of the project."""
    said = player["gaussian_avatar.gdextension"].decode()
    least = ".".join(map(str, _numbers(said[said.index("compatibility_minimum") :])[:2]))
    support = _between(godot_version(mark), least, least, f"{least} and newer")
    if support.known is not False and re.search(
        r'^renderer/rendering_method="gl_comp', _text(mark), re.MULTILINE
    ):
        needs = "it needs compute shaders: choose Forward+ or Mobile in place of Compatibility"
        return Support(None, f"{support.text}; {needs}")
    return support


def npm_support(mark: Path, player: Files) -> Support:
    """By the engines that package and player both name. npm refuses to install what asks for another minor."""
    said, peers = json_object(mark), json.loads(player["package.json"]).get("peerDependencies", {})
    own = {**_table(said, "devDependencies"), **_table(said, "dependencies")}
    both = [(name, str(own[name]), str(wanted)) for name, wanted in sorted(peers.items()) if name in own]
    other = [(name, has, wanted) for name, has, wanted in both if not _fits(has, wanted)]
    if not other:
        return Support(True, "the player supports it")
    wants = ", ".join(f"{name} {wanted}" for name, _, wanted in other)
    text = f"the player was tried with {wants}; this package has {', '.join(f'{n} {has}' for n, has, _ in other)}"
    return Support(None, f"{text}. npm installs it with --legacy-peer-deps")


def web_support(_mark: Path, _player: Files) -> Support:
    """Pages bring all that they need."""
    return Support(True, "the page needs nothing else")


def json_object(path: Path) -> dict[str, Any]:
    """The JSON object in a project's file. Raises AvatarError for anything else."""
    try:
        found = json.loads(read_bytes(path, LARGEST))
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise AvatarError("holds no JSON object; mend it first", file=path)
    return found


def _text(path: Path) -> str:
    return read_bytes(path, LARGEST).decode("utf-8-sig", "replace")


def _table(document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = document.get(key)
    return found if isinstance(found, dict) else {}


def _numbers(text: str) -> tuple[int, ...]:
    """The first three numbers of a version or of a range of versions."""
    return tuple(int(number) for number in NUMBER.findall(text)[:3])


def _fits(has: str, wanted: str) -> bool:
    """Whether a range of versions, by its first one, lies in a peer's: `~1.2.3 || >=2.0.0`. Unknown: yes."""
    own = _numbers(has)
    for one in wanted.split("||"):
        least = _numbers(one)
        if own >= least and (not one.strip().startswith("~") or own[:2] == least[:2]):
            return True
    return not own


def _between(version: str, least: str, last: str, said: str) -> Support:
    own = _numbers(version)
    if not own:
        return Support(None, f"the project does not say its version; the player is for {said}")
    if own < _numbers(least):
        return Support(False, f"the player needs {least} or newer")
    if own[: len(_numbers(last))] > _numbers(last):
        return Support(None, f"newer than the player knows, which is for {said}")
    return Support(True, f"the player supports it ({said})")
