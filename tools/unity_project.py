"""A Unity project for work on the package: `make unity`, or `python -m tools.unity_project [OUT]`.

Its package has links to the hand-written files of players/unity, so that edits and new files land in the checkout, and
real files for what is made. A .meta file lies beside each asset; git ignores those in the checkout. First, new files
get a row in guids.csv: with the GUID of the .meta file that Unity wrote, if there is one. Run it again after a change
of the shaders: scenes, settings and other packages of the project are kept.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Collection, Mapping
from itertools import chain, count
from pathlib import Path

from avatar_export.players.sources import folder
from avatar_export.players.unity import MANIFEST, TABLE, assets, guids, hand_written, metas, unity_made

ROOT = Path(__file__).resolve().parents[1]
TEST_FRAMEWORK = {"com.unity.test-framework": "1.1.33"}  # of 2022.3; later editors replace it by their own
_GUID = re.compile(r"^guid: ([0-9a-f]{32})$", re.MULTILINE)


class ProjectError(Exception):
    """What keeps the project from being laid out, and what to do, in one line."""


def main() -> None:
    """Adds rows of new files, and lays the project out."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "out" / "unity")
    try:
        for name in add_rows(folder("unity")):
            print(f"{TABLE}: new row: {name}")
        package = lay_out(folder("unity"), out)
    except (ProjectError, OSError) as error:
        print(f"unity_project: {error}", file=sys.stderr)
        sys.exit(2)
    print(
        f"{out}: add it in the Unity Hub (Add > Add project from disk); {package.name} in it is this checkout"
    )


def add_rows(root: Path) -> list[str]:
    """Adds a row to the table for each asset without one; returns their paths. Raises ProjectError."""
    known, found = guids(root), assets([*hand_written(root), *unity_made(root)])
    gone = {guid: name for name, guid in known.items() if name not in found}
    rows = {name: guid for name, guid in known.items() if name in found}
    new = [name for name in found if name not in known]
    for name in new:
        rows[name] = _guid(root, name, {*rows.values()})
    lost = sorted(gone.keys() - set(rows.values()))  # those moved in Unity, with their .meta file, are not
    if lost:
        what = (
            f"{gone[lost[0]]} is gone. If it was renamed, write its new path in its row; else delete the row"
        )
        raise ProjectError(f"{root / TABLE}: {what}")
    if new:
        text = "".join(f"{name},{guid}\n" for name, guid in sorted(rows.items()))
        (root / TABLE).write_text(f"path,guid\n{text}", "utf-8")
    return new


def lay_out(root: Path, out: Path) -> Path:
    """Writes the project; returns the folder of its package. Raises ProjectError, before anything is changed."""
    made = unity_made(root)
    manifest: dict[str, str] = json.loads(made[MANIFEST])
    package = out / "Packages" / manifest["name"]
    written = [name for name in hand_written(root) if name not in made]
    links = {name.partition("/")[0] for name in written}
    beside = metas([*written, *made], guids(root))
    _clear(package, root, links, {*made, *beside})
    package.mkdir(parents=True, exist_ok=True)
    for name in sorted(links):
        if not (package / name).is_symlink():
            (package / name).symlink_to(root / name)
    for name, content in made.items():
        _write(package / name, content)
    for name, content in beside.items():  # Unity adds to a .meta file: one with the right GUID stays
        if _guid_in(package / name) != _GUID.findall(content.decode())[0]:
            _write(package / name, content)
    for name, text in _empty_project(manifest).items():
        if not (out / name).exists():
            _write(out / name, text.encode())
    (out / "Assets").mkdir(exist_ok=True)
    return package


def _clear(package: Path, root: Path, links: Collection[str], real: Collection[str]) -> None:
    """Removes links and made files of before. Raises ProjectError for what is neither."""
    tops = {name.partition("/")[0] for name in real} - set(links)
    present = sorted(package.iterdir()) if package.exists() else []
    for path in present:
        if not path.is_symlink() and path.name not in tops and path.suffix != ".meta":
            raise ProjectError(f"{path} is not in the checkout. Move it to {root}, and run this again")
    old = [
        path
        for path in present
        if path.is_symlink() and (path.name not in links or path.resolve() != (root / path.name).resolve())
    ]
    old += [path for path in present if path.suffix == ".meta" and path.name not in real]
    for top in tops:
        below = (path for path in (package / top).rglob("*") if path.is_file())
        old += [path for path in below if path.relative_to(package).as_posix() not in real]
    for path in old:
        path.unlink()


def _empty_project(manifest: Mapping[str, str]) -> dict[str, str]:
    """{path: text} of what makes a folder a project, in which the package's tests can be run."""
    packages = {"dependencies": TEST_FRAMEWORK, "testables": [manifest["name"]]}
    return {
        "ProjectSettings/ProjectVersion.txt": f"m_EditorVersion: {manifest['unity']}.{manifest['unityRelease']}\n",
        "Packages/manifest.json": json.dumps(packages, indent=2) + "\n",
    }


def _guid(root: Path, name: str, taken: Collection[str]) -> str:
    """Unity's for a file that Unity has seen, else a hash of its path; one that is free."""
    hashed = (hashlib.md5(f"avatar-export/unity/{name}{'~' * k}".encode()).hexdigest() for k in count())
    offered = chain(filter(None, [_guid_in(root / f"{name}.meta")]), hashed)
    return next(guid for guid in offered if guid not in taken)


def _write(path: Path, content: bytes) -> None:
    if not path.is_file() or path.read_bytes() != content:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def _guid_in(meta: Path) -> str | None:
    found = _GUID.search(meta.read_text("utf-8")) if meta.is_file() else None
    return found[1] if found else None


if __name__ == "__main__":
    main()
