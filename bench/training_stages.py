"""CPU time of training without the rasteriser, forward and backward: kernels, and their definitions in torch.

    python -m bench.training_stages

20,000 Gaussians, 50 expressions with about 86,000 deltas of SH degree 1, a mesh of 10,000 vertices, images of
256 x 256; one thread.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Iterator

import numpy as np
import torch
from torch import Tensor

from avatar_runtime.avatar import Rules
from avatar_runtime.backends.cpu.threads import using
from avatar_trainer import kernels
from avatar_trainer.enhancer.network import enhanced, initial_weights
from avatar_trainer.kernels.mesh import kernel_mesh
from avatar_trainer.losses import ssim_definition
from avatar_trainer.stages.activate import activate
from avatar_trainer.stages.bind import bind_skin, skin_matrices
from avatar_trainer.stages.blend import Deltas, blend
from avatar_trainer.stages.rotation import polar
from avatar_trainer.stages.surface import SurfaceMesh, embed, pose_mesh, surface_mesh
from avatar_trainer.tensors import Gaussians, Splats

GAUSSIANS, EXPRESSIONS, DELTAS, COEFFICIENTS, SIDE, SIZE = 20_000, 50, 86_000, 4, 100, 256
REPEATS = 15
RULES = Rules("vertex_quaternion", position="normal", scale="log_area")
Step = Callable[[], Iterable[Tensor]]  # the outputs of one forward pass


def rows() -> Iterator[tuple[str, float]]:
    """(name, milliseconds of CPU time an iteration): forward and backward, on one thread."""
    before = torch.get_num_threads()
    try:
        with using(1):
            torch.set_num_threads(1)  # after Numba has started its threads, which sets the number for both
            for name, step, leaves in _steps():
                yield name, _cpu_ms(step, leaves)
    finally:
        torch.set_num_threads(before)


def _cpu_ms(step: Step, leaves: list[Tensor]) -> float:
    def once() -> float:
        for leaf in leaves:
            leaf.grad = None
        start = time.process_time()
        outputs = [output for output in step() if output.requires_grad]
        torch.autograd.backward(outputs, [torch.ones_like(output) for output in outputs])
        return time.process_time() - start

    once()
    return 1e3 * statistics.median(once() for _ in range(REPEATS))


def _steps() -> Iterator[tuple[str, Step, list[Tensor]]]:
    generator = torch.Generator().manual_seed(0)
    base, deltas, weights = _blendshapes(generator)
    leaves = [*_trained(base), *_trained(deltas)]
    yield "blend", lambda: vars(kernels.blend_cpu(base, deltas, weights)).values(), leaves
    yield "blend, torch", lambda: vars(blend(base, deltas, weights)).values(), leaves

    skin = torch.rand(GAUSSIANS, 5, generator=generator)
    joints = torch.eye(4).repeat(5, 1, 1)
    joints[:, :3] += 0.1 * torch.randn(5, 3, 4, generator=generator)
    matrix = skin_matrices(skin / skin.sum(1, keepdim=True), joints)
    yield "skin and activate", lambda: _seen(kernels.skinned_cpu(base, matrix)), leaves
    yield "skin and activate, torch", lambda: _seen(_skinned(base, matrix)), leaves

    mesh, vertices = _mesh(generator)
    values, triangle = _values_on(mesh, generator)
    for_kernels = kernel_mesh(mesh)
    yield "posed mesh", lambda: vars(kernels.pose_mesh_cpu(vertices, for_kernels, RULES)).values(), []
    yield "posed mesh, torch", lambda: vars(pose_mesh(vertices, mesh, RULES)).values(), []
    under, colour = pose_mesh(vertices, mesh, RULES), (base.opacity_logit, base.sh)
    yield (
        "embed and activate",
        lambda: _seen(kernels.embedded_cpu(under, mesh, triangle, *values, *colour, RULES)),
        values,
    )
    yield (
        "embed and activate, torch",
        lambda: _seen(_embedded(embed(under, mesh, triangle, *values, RULES), *colour)),
        values,
    )

    drawn, target = torch.rand(2, SIZE, SIZE, 3, generator=generator).unbind(0)
    drawn = drawn.clone().requires_grad_()
    yield "ssim", lambda: [kernels.ssim_cpu(drawn, target)], [drawn]
    yield "ssim, torch", lambda: [ssim_definition(drawn, target)], [drawn]

    network = initial_weights(generator)
    for tensor in network.values():
        tensor.requires_grad_()
    yield "enhancer", lambda: [enhanced(network, drawn)], [drawn, *network.values()]


def _blendshapes(generator: torch.Generator) -> tuple[Gaussians, Deltas, Tensor]:
    def values(count: int) -> dict[str, Tensor]:
        shapes = {
            "mean": (3,),
            "log_scale": (3,),
            "quat_wxyz": (4,),
            "opacity_logit": (),
            "sh": (COEFFICIENTS, 3),
        }
        return {
            name: torch.randn(count, *shape, generator=generator).requires_grad_()
            for name, shape in shapes.items()
        }

    used = torch.rand(GAUSSIANS, EXPRESSIONS, generator=generator) < DELTAS / (GAUSSIANS * EXPRESSIONS)
    row_ptr = torch.nn.functional.pad(used.sum(1).cumsum(0), (1, 0))
    column = used.nonzero()[:, 1].contiguous()
    weights = torch.rand(EXPRESSIONS, generator=generator)
    weights[::2] = 0
    return Gaussians(**values(GAUSSIANS)), Deltas(row_ptr, column, **values(len(column))), weights


def _trained(part: Gaussians | Deltas) -> list[Tensor]:
    return [value for value in vars(part).values() if value.requires_grad]


def _skinned(base: Gaussians, matrix: Tensor) -> Splats:
    return activate(*bind_skin(base, matrix, polar(matrix[:, :, :3])))


def _embedded(embedded: object, opacity_logit: Tensor, sh: Tensor) -> Splats:
    c = vars(embedded)
    return activate(Gaussians(c["mean"], c["log_scale"], c["quat_wxyz"], opacity_logit, sh), c["rotation"])


def _seen(splats: Splats) -> list[Tensor]:
    return [splats.mean, splats.scale, splats.quat_wxyz, splats.opacity]


def _mesh(generator: torch.Generator) -> tuple[SurfaceMesh, Tensor]:
    """A rough sheet, and another pose of it."""
    line = torch.linspace(0, 0.2, SIDE)
    height = 0.01 * torch.rand(SIDE * SIDE, 1, generator=generator)
    flat = torch.cat([torch.cartesian_prod(line, line), height], dim=1)
    at = np.arange(SIDE * SIDE, dtype=np.uint32).reshape(SIDE, SIDE)
    below = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, :-1]], axis=-1)
    above = np.stack([at[1:, 1:], at[1:, :-1], at[:-1, 1:]], axis=-1)
    triangles = np.concatenate([below.reshape(-1, 3), above.reshape(-1, 3)])
    moved = flat + 1e-3 * torch.randn(flat.shape, generator=generator)
    return surface_mesh(flat.numpy(), triangles, 4.0), moved


def _values_on(mesh: SurfaceMesh, generator: torch.Generator) -> tuple[list[Tensor], Tensor]:
    """Barycentric, displacement, local quaternion and log scale; triangles."""
    corners = torch.rand(GAUSSIANS, 3, generator=generator)
    values = (
        corners / corners.sum(1, keepdim=True),
        1e-3 * torch.randn(GAUSSIANS, generator=generator),
        torch.randn(GAUSSIANS, 4, generator=generator),
        torch.randn(GAUSSIANS, 3, generator=generator) - 5,
    )
    triangle = torch.randint(len(mesh.triangles), (GAUSSIANS,), generator=generator)
    return [value.requires_grad_() for value in values], triangle


if __name__ == "__main__":
    for row, milliseconds in rows():
        print(f"{row:26} {milliseconds:8.2f} ms")
