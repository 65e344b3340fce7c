"""What the packages of a distribution import is what the distribution asks for, no less and no more."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tools import dist

PART_OF = {"llvmlite": "numba"}  # numba asks for the one llvmlite that fits it
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
    """Names in requirements, the project's own left out."""
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


def test_extras_are_passed_on() -> None:
    rows = dist.distributions()
    for extra in rows["avatar-export-runtime"].extras.keys() - {"fast"}:
        assert rows["avatar-export"].extras[extra] == [f"avatar-export-runtime[{extra}]=={dist.version()}"]
    assert rows["avatar-export"].extras.keys() == {"all", "batch", "enhance", "fast", "fbx", "gl", "train"}
    [line] = rows["avatar-export"].extras["all"]
    assert Requirement(line).extras == rows["avatar-export"].extras.keys() - {"all", "fast"}


def test_numba_comes_with_the_exporter_and_is_an_extra_of_the_runtime() -> None:
    rows = dist.distributions()
    [numba] = [line for line in rows["avatar-export"].dependencies if line.startswith("numba")]
    assert rows["avatar-export-runtime"].extras["fast"] == [numba]
    assert rows["avatar-export"].extras["fast"] == []
