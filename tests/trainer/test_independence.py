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
    """Every module that a file imports, also inside functions."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


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


# Every module with kernels -> what defines its results, and the tests that hold values to it (and gradients, where the
# kernel has them).
PARITY = {
    "asm/faces.py": ("asm.model.posed", "asm/test_model.py::test_many_at_once_are_the_same_faces"),
    "asm/kernels/closest.py": (
        "a search through every triangle; differences",
        "asm/kernels/test_closest.py::test_distances_are_those_of_a_search_through_every_triangle",
        "asm/kernels/test_closest.py::test_gradients_are_those_of_differences",
    ),
    "asm/kernels/consistency.py": (
        "the correlation of patches in torch",
        "asm/views/test_energies.py::test_the_kernel_has_the_definitions_value_and_gradients",
    ),
    "asm/kernels/mixture.py": (
        "asm.model.weights",
        "asm/kernels/test_mixture.py::test_values_and_gradients_are_those_of_the_definition",
    ),
    "asm/kernels/zbuffer.py": (
        "depths by hand",
        "asm/views/test_energies.py::test_slanted_depth_is_perspective",
    ),
    "asm/template/weights.py": (
        "the same linear system, solved densely",
        "asm/test_weights.py::test_heat_is_the_solution_of_its_linear_system",
    ),
    "captures/mesh_raster.py": ("rays", "captures/test_mesh_raster.py::test_agrees_with_rays_in_world_space"),
    "kernels/activation.py": (
        "stages.activate, by kernels/skin.py and kernels/surface.py",
        "kernels/test_parity.py::test_skin",
        "kernels/test_parity.py::test_surface",
    ),
    "kernels/blend.py": ("stages.blend.blend", "kernels/test_parity.py::test_blend"),
    "kernels/mesh_points.py": (
        "stages.surface.embed and bary_vertex_rotation",
        "kernels/test_mesh_points.py::test_it_is_embed_with_gradients_for_the_mesh",
        "kernels/test_mesh_points.py::test_turns_are_those_of_the_stage",
    ),
    "kernels/neighbours.py": (
        "all distances",
        "kernels/test_neighbours.py::test_the_nearest_others_are_those_of_all_distances",
    ),
    "kernels/skin.py": ("stages.bind.bind_skin and stages.activate", "kernels/test_parity.py::test_skin"),
    "kernels/smooth.py": (
        "means by hand",
        "systems/psavatar/test_steady.py::test_bases_go_towards_the_mean_of_their_neighbours_and_to_0",
    ),
    "kernels/ssim.py": ("losses.ssim_definition", "kernels/test_parity.py::test_ssim"),
    "kernels/surface.py": ("stages.surface.pose_mesh and embed", "kernels/test_parity.py::test_surface"),
    "systems/psavatar/anchors.py": (
        "the roots of a cubic",
        "systems/psavatar/test_anchors.py::test_places_are_held_by_the_steadiest_triangle",
    ),
    **dict.fromkeys(
        (f"raster/{name}_backward.py" for name in ("colour", "composite", "geometry", "project")),
        ("raster.definition", "raster/test_cpu.py::test_gradients_are_the_definitions"),
    ),
    **dict.fromkeys(
        ("raster/points_geometry.py", "raster/points_kernels.py"),
        ("raster.points_definition", "raster/test_points.py::test_kernels_are_the_definition"),
    ),
    "systems/common/poisson.py": (
        "all distances",
        "systems/common/test_poisson.py::test_searched_neighbours_are_the_nearest",
    ),
    "systems/gaussian_blendshapes/blend.py": (
        "stages.blend.blend",
        "systems/gaussian_blendshapes/test_blend.py::test_init_terms_are_blended",
    ),
    "systems/splatting_avatar/phong.py": (
        "random points of the surface",
        "systems/splatting_avatar/test_phong.py::test_beyond_the_border_nothing_is_nearer",
    ),
    "systems/splatting_avatar/walk.py": (
        "a straight line, and the released walker",
        "systems/splatting_avatar/test_walk.py::test_a_walk_is_a_straight_line",
        "systems/splatting_avatar/test_walk.py::test_the_released_walker_goes_the_same_way",
    ),
}


def test_every_kernel_is_held_to_its_definition() -> None:
    package = ROOT / "trainer/avatar_trainer"
    jit = "avatar_runtime.backends.cpu.jit"
    kernels = {str(f.relative_to(package)) for f in package.rglob("*.py") if jit in set(imports(f))}
    assert kernels == set(PARITY)
    for module, (_, *tests) in PARITY.items():
        assert tests, module
        for test in tests:
            file, _, name = test.partition("::")
            text = (Path(__file__).parent / file).read_text("utf-8")
            assert f"def {name}(" in text, f"{module}: {test} is gone"
