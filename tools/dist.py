"""Makes what a release holds: `python -m tools.dist [OUT]` builds the add-on for Godot for all
platforms, and writes both distributions and an archive of each player.

A checkout installs as one distribution with all five packages. For publishing, the table [tool.distributions] in
pyproject.toml splits it: each distribution gets a source tree with a plain pyproject.toml, from which its sdist and its
wheel are built. Same checkout, same hatchling, same bytes.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from dataclasses import dataclass
from email import message_from_bytes
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.wheel import WheelBuilder
from packaging.metadata import Metadata
from packaging.requirements import Requirement

from avatar_runtime.io.errors import AvatarError
from avatar_shaders.tools import ShaderError
from tools import archives
from tools.godot.build import TARGETS, BuildError
from tools.godot.build import build as build_add_on

ROOT = Path(__file__).parents[1]
LICENSES = ("LICENSE", "NOTICE.md")
SUFFIXES = {  # of files that may be in a package
    *(".py", ".typed", ".json", ".hlsl", ".hlsli"),
    *(".comp", ".vert", ".frag", ".metal", ".wgsl", ".hpp"),
    *(".html", ".css", ".js"),
    *(".npz", ".txt", ".tflite", ".task", ".gz"),  # the head model, networks, MediaPipe, their licences
}
PLAYERS = "avatar_export/players/files/"  # of engines: any file
ENDS = {"sdist": ".tar.gz", "wheel": "-py3-none-any.whl"}


class DistError(Exception):
    """What is wrong with a source tree or with what was built from it, in one line."""


@dataclass(frozen=True)
class Distribution:
    """One row of [tool.distributions], with what it takes from [project]."""

    name: str
    version: str
    description: str
    readme: str
    packages: tuple[str, ...]  # folders, relative to the root
    dependencies: tuple[str, ...]
    extras: dict[str, list[str]]
    scripts: dict[str, str]
    shared: dict[str, Any]  # the fields of [project] and [build-system] that are the same for both

    @property
    def stem(self) -> str:
        """How the names of its files begin."""
        return f"{self.name.replace('-', '_')}-{self.version}"


def version() -> str:
    """The version of both distributions."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    text = (ROOT / project["tool"]["hatch"]["version"]["path"]).read_text("utf-8")
    found = re.search(r'^__version__ = "(.+)"$', text, re.MULTILINE)
    if found is None:
        raise DistError(f"{project['tool']['hatch']['version']['path']}: holds no version")
    return found[1]


def distributions() -> dict[str, Distribution]:
    """Both, by name. Raises KeyError for a dependency or extra that [project] does not list."""
    document = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    project, rows = document["project"], document["tool"]["distributions"]
    bounds = {Requirement(line).name: line for line in project["dependencies"]}
    bounds |= {name: f"{name}=={version()}" for name in rows}
    extras = project["optional-dependencies"]
    owner = {extra: name for name, row in rows.items() for extra in row["extras"]}
    made = {}
    for name, row in rows.items():
        passed_on = {x: [f"{owner[x]}[{x}]=={version()}"] for x in extras if owner[x] in row["dependencies"]}
        own = {"fast": [bounds[dependency] for dependency in row["fast"]]} if "fast" in row else {}
        packages = {Path(folder).name for folder in row["packages"]}
        made[name] = Distribution(
            name,
            version(),
            row.get("description", project["description"]),
            row.get("readme", project["readme"]),
            tuple(row["packages"]),
            tuple(bounds[dependency] for dependency in row["dependencies"]),
            {x: extras[x] for x in row["extras"]} | passed_on | own,
            {s: at for s, at in project.get("scripts", {}).items() if at.partition(".")[0] in packages},
            {key: project[key] for key in ("license", "requires-python", "classifiers")}
            | document["build-system"],
        )
    return made


def pyproject(given: Distribution) -> str:
    """The text of a distribution's own pyproject.toml. A string or list of strings in JSON is one in TOML."""
    toml = json.dumps
    packages = [f"src/{Path(folder).name}" for folder in given.packages]
    tables: dict[str, dict[str, Any]] = {
        "build-system": {key: given.shared[key] for key in ("requires", "build-backend")},
        "project": {
            "name": given.name,
            "version": given.version,
            "description": given.description,
            "readme": "README.md",
            "license": given.shared["license"],
            "license-files": LICENSES,
            "requires-python": given.shared["requires-python"],
            "classifiers": given.shared["classifiers"],
            "dependencies": given.dependencies,
        },
        "project.scripts": given.scripts,
        "project.optional-dependencies": dict(sorted(given.extras.items())),
        "tool.hatch.build.targets.wheel": {"packages": packages},
    }
    blocks = (
        f"[{table}]\n" + "".join(f"{key} = {toml(value)}\n" for key, value in rows.items())
        for table, rows in tables.items()
        if rows
    )
    return "\n".join(blocks)


def checkout() -> dict[str, Path]:
    """What the checkout installs as one distribution, by the path in its wheel."""
    files = WheelBuilder(str(ROOT)).recurse_included_files()
    return {file.distribution_path: Path(file.path) for file in files}


def sources(given: Distribution) -> dict[str, Path]:
    """The files of its packages, by their path in a wheel. Raises DistError for one that does not belong there."""
    packages = {Path(folder).name for folder in given.packages}
    found = {name: path for name, path in checkout().items() if name.partition("/")[0] in packages}
    for name in found:
        if not name.startswith(PLAYERS) and Path(name).suffix not in SUFFIXES:
            raise DistError(f"{name}: not a file of a package; remove it, or add to SUFFIXES")
    return dict(sorted(found.items()))


def assemble(given: Distribution, folder: Path) -> Path:
    """Writes the source tree of a distribution into `folder`; returns its root."""
    tree = folder / given.stem
    for name, path in sources(given).items():
        (tree / "src" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, tree / "src" / name)
    for name, source in {**{name: name for name in LICENSES}, "README.md": given.readme}.items():
        shutil.copyfile(ROOT / source, tree / name)
    (tree / "pyproject.toml").write_text(pyproject(given), "utf-8")
    return tree


def build(tree: Path, out: Path, *targets: str) -> list[Path]:
    """Builds targets ("sdist", "wheel") of a source tree with the installed hatchling; returns the files."""
    asked = [word for target in targets for word in ("-t", target)]
    command = [sys.executable, "-m", "hatchling", "build", *asked, "-d", str(out.resolve())]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True)
    if done.returncode:
        raise DistError(f"{tree.name}: hatchling failed: {done.stderr or done.stdout}")
    return [out / f"{tree.name}{ENDS[target]}" for target in targets]


def make(given: Distribution, out: Path) -> list[Path]:
    """Writes sdist and wheel of a distribution into `out`, checked; returns both. Raises DistError."""
    with TemporaryDirectory() as made:
        tree = assemble(given, Path(made))
        sdist, wheel = build(tree, out, "sdist", "wheel")
        with tarfile.open(sdist) as archive:
            archive.extractall(Path(made, "unpacked"), filter="data")
        [again] = build(Path(made, "unpacked", given.stem), Path(made), "wheel")
        if again.read_bytes() != wheel.read_bytes():
            raise DistError(f"{sdist.name}: builds another wheel than the tree that it was made of")
    check(given, sdist, wheel)
    return [sdist, wheel]


def check(given: Distribution, sdist: Path, wheel: Path) -> None:
    """Raises DistError where the files hold more or less than they should, or other metadata."""
    files = sources(given)
    info = f"{given.stem}.dist-info"
    expected = {*files, *(f"{info}/{name}" for name in ("METADATA", "WHEEL", "RECORD"))}
    expected |= {f"{info}/licenses/{name}" for name in LICENSES}
    expected |= {f"{info}/entry_points.txt"} if given.scripts else set()
    with zipfile.ZipFile(wheel) as archive:
        _same(wheel, set(archive.namelist()), expected)
        _check_metadata(given, wheel, archive.read(f"{info}/METADATA"))
    own = {f"src/{name}" for name in files} | {*LICENSES, "README.md", "PKG-INFO", "pyproject.toml"}
    with tarfile.open(sdist) as packed:
        held = {item.name for item in packed.getmembers() if item.isfile()}
        _same(sdist, held, {f"{given.stem}/{name}" for name in own})
        stream = packed.extractfile(f"{given.stem}/PKG-INFO")
        _check_metadata(given, sdist, stream.read() if stream else b"")


def _same(file: Path, held: set[str], expected: set[str]) -> None:
    for what, names in (("holds also", held - expected), ("lacks", expected - held)):
        if names:
            raise DistError(f"{file.name}: {what} {', '.join(sorted(names))}")


def _check_metadata(given: Distribution, file: Path, data: bytes) -> None:
    """Valid by the standard, as pyproject.toml says, and with nothing that an index refuses."""
    metadata = Metadata.from_email(data, validate=True)
    if (metadata.name, str(metadata.version)) != (given.name, given.version):
        raise DistError(f"{file.name}: is called {metadata.name} {metadata.version}")
    requires = metadata.requires_dist or []
    if any(requirement.url for requirement in requires):
        raise DistError(f"{file.name}: an index refuses dependencies with an address")
    base = {str(requirement) for requirement in requires if "extra ==" not in str(requirement.marker)}
    if base != {str(Requirement(line)) for line in given.dependencies}:
        raise DistError(f"{file.name}: depends on {', '.join(sorted(base))}")
    if message_from_bytes(data)["Description-Content-Type"] != "text/markdown" or not metadata.description:
        raise DistError(f"{file.name}: carries no description in Markdown")


def main() -> None:
    """Empties OUT (default `dist`) of earlier builds, writes distributions and archives, prints the files."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "dist")
    out.mkdir(parents=True, exist_ok=True)
    for name in ("avatar_*.whl", "avatar_*.tar.gz"):
        for old in out.glob(name):
            old.unlink()
    try:
        for target in TARGETS:
            build_add_on(target)
        _say(archives.write(out))  # first: it knows whether the npm package, which the wheel holds, is built
        for given in distributions().values():
            _say(make(given, out))
    except (DistError, AvatarError, BuildError, ShaderError) as error:
        sys.exit(f"dist: {error}")


def _say(files: list[Path]) -> None:
    for file in files:
        print(f"{file}  {file.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
