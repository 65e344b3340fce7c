"""What `make dist` makes, what a checkout installs as, and the one version of both."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import avatar_export
from tools import dist

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PACKAGES = {
    Path(folder).name: ROOT / folder
    for row in PROJECT["tool"]["distributions"].values()
    for folder in row["packages"]
}
EDITABLE = "import sys, hatchling.build; print(hatchling.build.build_editable(sys.argv[1]))"


def test_the_version_stands_in_one_place() -> None:
    assert avatar_export.__version__ == dist.version()
    assert "version" not in PROJECT["project"]
    literal = re.compile(rf"(?<![\d.]){re.escape(dist.version())}(?![\d.])")
    files = [path for folder in PACKAGES.values() for path in sorted(folder.rglob("*.py"))]
    where = [path.name for path in files if literal.search(path.read_text("utf-8"))]
    assert where == ["version.py"]
    for line in (ROOT / "pyproject.toml").read_text("utf-8").splitlines():
        assert "avatar" not in line or not literal.search(line), line
    citation = ROOT / "CITATION.cff"
    if citation.exists():
        assert f"\nversion: {dist.version()}\n" in citation.read_text("utf-8")


def test_a_checkout_installs_as_one(tmp_path: Path) -> None:
    """`pip install .`: all five packages, every dependency, no distribution that an index would be asked for."""
    wheel = root_wheel(tmp_path)
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
        info = message_from_bytes(archive.read(f"avatar_export-{dist.version()}.dist-info/METADATA"))
    assert held == {name for given in dist.distributions().values() for name in dist.sources(given)}
    for folder in PACKAGES.values():
        assert {path.relative_to(folder.parent).as_posix() for path in folder.rglob("*.py")} <= held
    base = {line for line in info.get_all("Requires-Dist", []) if "extra ==" not in line}
    split = {line for given in dist.distributions().values() for line in given.dependencies}
    assert base == {line for line in split if not line.startswith("avatar-export-runtime")}
    assert "Private :: Do Not Upload" in info.get_all("Classifier", [])


def root_wheel(out: Path) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(out)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return next(out.glob("*.whl"))


def test_an_editable_install_sees_every_source_root(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", EDITABLE, tmp_path], cwd=ROOT, check=True, capture_output=True
    )
    with zipfile.ZipFile(tmp_path / done.stdout.decode().split()[-1]) as archive:
        [path_file] = [name for name in archive.namelist() if name.endswith(".pth")]
        roots = archive.read(path_file).decode().split()
    assert {Path(root).resolve() for root in roots} == {folder.parent for folder in PACKAGES.values()}


# numba asks for the one llvmlite that fits it; two packages hold cv2, and mediapipe asks for one of them, as we do
PART_OF = {"llvmlite": "numba", "opencv-python": "opencv-contrib-python"}
BY_NAME = {"torch.utils.tensorboard": "tensorboard"}  # a module of torch that imports another library
USERS_OWN = {"gsplat", "lpips"}  # no extra has them: who asks for one by name is told to install it


@cache
def owners() -> dict[str, str]:
    """The distribution that a top-level module comes from, for every one that is installed here."""
    return {module: canonicalize_name(names[0]) for module, names in packages_distributions().items()}


def modules(tree: ast.AST) -> Iterator[str]:
    """Full names of what a file imports, wherever the import stands."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module


def imported(given: dist.Distribution) -> set[str]:
    """Distributions that its packages import from, the project's own left out."""
    own = {Path(folder).name for row in dist.distributions().values() for folder in row.packages}
    found = set()
    for name, path in dist.sources(given).items():
        if path.suffix == ".py":
            for module in modules(ast.parse(path.read_text("utf-8"))):
                top = module.partition(".")[0]
                if top not in sys.stdlib_module_names | own | USERS_OWN:
                    assert top in owners(), f"{name} imports {top}, which no installed distribution has"
                    found |= {PART_OF.get(owners()[top], owners()[top])}
                found |= {BY_NAME[module]} if module in BY_NAME else set()
    return found


def asked(lines: list[str] | tuple[str, ...]) -> set[str]:
    names = {canonicalize_name(Requirement(line).name) for line in lines}
    return names - dist.distributions().keys()


def passed_on(given: dist.Distribution) -> set[str]:
    """What its extras bring by way of extras of the distribution that it depends on."""
    lines = [Requirement(line) for extra in given.extras.values() for line in extra]
    rows = dist.distributions()
    return {
        name
        for line in lines
        if line.name != given.name and line.name in rows
        for extra in line.extras
        for name in asked(rows[line.name].extras[extra])
    }


@pytest.mark.parametrize("name", dist.distributions())
def test_what_is_imported_is_what_is_asked_for(name: str) -> None:
    given = dist.distributions()[name]
    own = asked(given.dependencies) | {x for extra in given.extras.values() for x in asked(extra)}
    found = imported(given)
    assert not found - own - passed_on(given), "imported, but not asked for"
    assert not own - found, "asked for, but not imported"
