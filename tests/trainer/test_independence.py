"""Independence: the torch definitions share no code with the kernels, and every kernel has a test against one.

`conform --backend cpu` plays stage vectors that the definitions made. If a definition called a kernel of the runtime,
or an array builder of its backend, the kit would compare code with itself.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "avatar_schema": ROOT / "schema",
    "avatar_runtime": ROOT / "runtime",
    "avatar_export": ROOT / "exporter",
    "avatar_trainer": ROOT / "trainer",
}
STAGES = ROOT / "trainer/avatar_trainer/stages"
DEFINITIONS = [
    *(f"avatar_trainer.stages.{file.stem}" for file in sorted(STAGES.glob("[!_]*.py"))),
    "avatar_trainer.raster.definition",
    "avatar_trainer.bundles.definitions",
]
KERNELS = ("numba", "avatar_runtime.backends.cpu", "avatar_runtime.backends.gl", "avatar_trainer.kernels")


def file_of(module: str) -> Path | None:
    """The file of a module of ours."""
    if module.partition(".")[0] not in PACKAGES:
        return None
    place = PACKAGES[module.partition(".")[0]] / module.replace(".", "/")
    return next((f for f in (place.with_suffix(".py"), place / "__init__.py") if f.is_file()), None)


def imports(file: Path) -> Iterator[str]:
    """Every module that a file imports when it runs, also inside functions."""
    waiting: list[ast.AST] = [ast.parse(file.read_text("utf-8"))]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        waiting += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                yield from (giver_of(node.module, alias.name), f"{node.module}.{alias.name}")


def giver_of(module: str, name: str) -> str:
    """The module that `from module import name` is about: itself, or where a package's __init__ takes `name` from."""
    if file_of(f"{module}.{name}") is not None:
        return f"{module}.{name}"
    file = file_of(module)
    for node in (
        ast.parse(file.read_text("utf-8")).body if file is not None and file.stem == "__init__" else ()
    ):
        if isinstance(node, ast.ImportFrom) and node.module and name in (alias.name for alias in node.names):
            return node.module
    return module


def reached(module: str) -> dict[str, str]:
    """Every module that `module` imports, directly or not -> one that imports it."""
    found: dict[str, str] = {}
    waiting = [module]
    while waiting:
        own = waiting.pop()
        file = file_of(own)
        for name in imports(file) if file is not None else ():
            if name not in found:
                found[name] = own
                waiting.append(name)
    return found


@pytest.mark.parametrize("module", DEFINITIONS)
def test_a_definition_reaches_no_kernel(module: str) -> None:
    assert file_of(module) is not None
    for name, by in reached(module).items():
        assert not any(name == k or name.startswith(f"{k}.") for k in KERNELS), f"{by} imports {name}"


# Every module with kernels -> the tests that hold its values to a definition, and its gradients, where it has them.
PARITY = {
    "asm/faces.py": "asm/test_model.py::test_many_at_once_are_the_same_faces",
    "asm/kernels/closest.py": """
        asm/kernels/test_closest.py::test_distances_are_those_of_a_search_through_every_triangle
        asm/kernels/test_closest.py::test_gradients_are_those_of_differences""",
    "asm/kernels/consistency.py": "asm/views/test_energies.py::test_the_kernel_has_the_definitions_value_and_gradients",
    "asm/kernels/mixture.py": "asm/kernels/test_mixture.py::test_values_and_gradients_are_those_of_the_definition",
    "asm/kernels/zbuffer.py": "asm/views/test_energies.py::test_slanted_depth_is_perspective",
    "asm/template/weights.py": "asm/test_template.py::test_heat_is_the_solution_of_its_linear_system",
    "captures/mesh_raster.py": "captures/test_mesh_raster.py::test_agrees_with_rays_in_world_space",
    "kernels/activation.py": "kernels/test_parity.py::test_skin kernels/test_parity.py::test_surface",
    "kernels/blend.py": "kernels/test_parity.py::test_blend",
    "kernels/least_squares.py": """kernels/test_least_squares.py::test_the_normal_matrix_is_its_sum
        kernels/test_least_squares.py::test_a_bounded_solution_is_the_least""",
    "kernels/mesh_points.py": """kernels/test_mesh_points.py::test_it_is_embed_with_gradients_for_the_mesh
        kernels/test_mesh_points.py::test_turns_are_those_of_the_stage""",
    "kernels/neighbours.py": "kernels/test_neighbours.py::test_the_nearest_others_are_those_of_all_distances",
    "kernels/skin.py": "kernels/test_parity.py::test_skin",
    "kernels/smooth.py":
        "systems/psavatar/test_steady.py::test_bases_go_towards_the_mean_of_their_neighbours_and_to_0",
    "kernels/ssim.py": "kernels/test_parity.py::test_ssim",
    "kernels/surface.py": "kernels/test_parity.py::test_surface",
    "systems/psavatar/anchors.py":
        "systems/psavatar/test_anchors.py::test_places_are_held_by_the_steadiest_triangle",
    **{f"raster/{name}_backward.py": "raster/test_cpu.py::test_gradients_are_the_definitions"
       for name in ("colour", "composite", "geometry", "project")},
    **{f"raster/points_{name}.py": "raster/test_points.py::test_kernels_are_the_definition"
       for name in ("geometry", "kernels")},
    "systems/common/poisson.py": "systems/common/test_poisson.py::test_searched_neighbours_are_the_nearest",
    "systems/gaussian_blendshapes/blend.py": """
        systems/gaussian_blendshapes/test_files.py::test_the_files_play_what_was_trained
        systems/gaussian_blendshapes/test_system.py::test_gradients_are_the_slope""",
    "systems/splatting_avatar/phong.py":
        "systems/splatting_avatar/test_phong.py::test_beyond_the_border_nothing_is_nearer",
    "systems/splatting_avatar/walk.py": """systems/splatting_avatar/test_walk.py::test_a_walk_is_a_straight_line
        systems/splatting_avatar/test_walk.py::test_the_released_walker_goes_the_same_way""",
}  # fmt: skip


def test_every_kernel_is_held_to_its_definition() -> None:
    package = ROOT / "trainer/avatar_trainer"
    compiled = {f"avatar_runtime.backends.cpu.{name}" for name in ("inlined", "kernel")}
    kernels = {str(f.relative_to(package)) for f in package.rglob("*.py") if compiled & set(imports(f))}
    assert kernels == set(PARITY)
    for module, tests in PARITY.items():
        for test in tests.split():
            file, _, name = test.partition("::")
            text = (Path(__file__).parent / file).read_text("utf-8")
            assert f"def {name}(" in text, f"{module}: {test} is gone"
