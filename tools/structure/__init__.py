"""How the code is laid out: `python -m tools.structure` prints it, tests/test_structure.py holds it to its limits.

A room is a folder of a package, and so is each file: the children of one folder are rooms side by side. An import
anywhere in a file counts, also inside a function.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCES = {  # import package: the folder that holds it
    "avatar_schema": "schema",
    "avatar_shaders": "engine_shaders",
    "avatar_runtime": "runtime",
    "avatar_export": "exporter",
    "avatar_trainer": "trainer",
    "samples": ".",
    "bench": ".",
    "tests": ".",
    "tools": ".",
}
WORKSHOP = {"bench", "tests", "tools"}  # one room: tests hold the others, which use what tests make
PUBLIC = tuple(SOURCES)[:5]  # packages whose public names need a docstring
MOST_MODULES = 20  # handwritten Python modules in one folder
MOST_LINES = 400  # of one handwritten Python file
BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")  # where a node of a tree holds statements
PASSED_OVER = {"node_modules", "__pycache__"}

Graph = Mapping[str, set[str]]


@dataclass(frozen=True)
class Module:
    """One Python file. Its tree is not kept: all of them are two million objects."""

    name: str  # dotted
    path: Path
    lines: int
    imports: tuple[
        tuple[str, frozenset[str]], ...
    ]  # (module, names from it), both dotted; no names: it as a whole
    undocumented: tuple[str, ...]  # public names without docstring


@cache
def modules() -> Mapping[str, Module]:
    """Every handwritten Python module, by dotted name."""
    found = {}
    for package, folder in SOURCES.items():
        base = ROOT / folder
        for path in sorted((base / package).rglob("*.py")):
            if PASSED_OVER & set(path.parts):
                continue
            parts = path.relative_to(base).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            text = path.read_text("utf-8")
            tree = ast.parse(text)
            lines = len(text.splitlines())
            found[name] = Module(name, path, lines, tuple(_imports(tree)), tuple(_undocumented(name, tree)))
    return found


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements in `node`, at any depth; expressions, which are most of a tree, are not entered."""
    for block in BLOCKS:
        for inner in getattr(node, block, ()):
            yield inner
            yield from statements(inner)


def _imports(tree: ast.Module) -> Iterator[tuple[str, frozenset[str]]]:
    for node in statements(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, frozenset()) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module, frozenset(f"{node.module}.{alias.name}" for alias in node.names)


def imported(module: Module, known: Set[str]) -> set[str]:
    """The names among `known` that a module imports: whole modules, or what stands in them."""
    names: set[str] = set()
    for whole, inner in module.imports:
        names |= inner & known or {whole}
        if not inner <= known:
            names.add(whole)
    return (names & known) - {module.name}


@cache
def imports() -> Graph:
    """module -> modules that it imports. A package's face that only passes names on counts as the package."""
    known = set(modules())
    return {name: imported(module, known) for name, module in modules().items()}


def file_circles() -> list[list[str]]:
    """Sets of files that import each other in a circle. The face of a package (its `__init__`) takes part."""
    return circles(imports())


def room_circles() -> list[list[str]]:
    """Sets of sibling rooms, in any folder, that import each other in a circle."""
    graphs: dict[tuple[str, ...], dict[str, set[str]]] = {}
    for name, targets in imports().items():
        for target in targets:
            own, other = name.split("."), target.split(".")
            parts = enumerate(zip(own, other, strict=False))
            depth = next(
                (k for k, (a, b) in parts if a != b), None
            )  # None: one is the face of a room that holds both
            if depth is not None and not {own[depth], other[depth]} <= WORKSHOP:
                graph = graphs.setdefault(tuple(own[:depth]), {})
                graph.setdefault(".".join(own[: depth + 1]), set()).add(".".join(other[: depth + 1]))
    return [found for _, graph in sorted(graphs.items()) for found in circles(graph)]


def child(folder: str, name: str) -> str | None:
    """The room directly in `folder` that holds module `name`; None for the folder's own face and for others."""
    start = f"{folder}." if folder else ""
    if not name.startswith(start) or name == folder:
        return None
    return start + name[len(start) :].split(".")[0]


def circles(graph: Graph) -> list[list[str]]:
    """Strongly connected sets of more than one node (Tarjan 1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for target in sorted(graph.get(node, ())):
            if target not in index:
                visit(target)
                low[node] = min(low[node], low[target])
            elif target in stack:
                low[node] = min(low[node], index[target])
        if low[node] == index[node]:
            at = stack.index(node)
            if len(stack) - at > 1:
                found.append(sorted(stack[at:]))
            del stack[at:]

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return found


def full_folders() -> dict[str, int]:
    """Folders and how many handwritten modules each holds, the fullest first."""
    count: dict[str, int] = {}
    for module in modules().values():
        folder = module.path.parent.relative_to(ROOT).as_posix()
        count[folder] = count.get(folder, 0) + 1
    return dict(sorted(count.items(), key=lambda item: -item[1]))


def long_files() -> dict[str, int]:
    """Files and their lines, the longest first."""
    lines = {m.path.relative_to(ROOT).as_posix(): m.lines for m in modules().values()}
    return dict(sorted(lines.items(), key=lambda item: -item[1]))


def without_docstring() -> list[str]:
    """Public modules, classes, functions and methods of the packages that have no docstring."""
    owned = (m for m in modules().values() if m.name.split(".")[0] in PUBLIC)
    return [name for module in owned for name in module.undocumented]


def _undocumented(module: str, tree: ast.Module) -> Iterator[str]:
    if tree.body and not ast.get_docstring(tree):
        yield module
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            if not ast.get_docstring(node):
                yield f"{module}.{node.name}"
            if isinstance(node, ast.ClassDef):
                yield from _methods(module, node)


def _methods(module: str, owner: ast.ClassDef) -> Iterator[str]:
    for node in owner.body:
        if not isinstance(node, ast.FunctionDef) or node.name.startswith("_") or _overload(node):
            continue
        if not ast.get_docstring(node):
            yield f"{module}.{owner.name}.{node.name}"


def _overload(node: ast.FunctionDef) -> bool:
    return any(isinstance(d, ast.Name) and d.id == "overload" for d in node.decorator_list)
