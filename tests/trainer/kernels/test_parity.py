"""The kernels of training: the values and gradients of their plain definitions, the same bits on any threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from avatar_runtime.avatar import Rules
from avatar_runtime.backends.cpu.threads import using
from avatar_trainer.kernels import blend_cpu, embedded_cpu, pose_mesh_cpu, skinned_cpu, ssim_cpu
from avatar_trainer.kernels.mesh import kernel_mesh
from avatar_trainer.losses import ssim_definition
from avatar_trainer.stages.activate import activate
from avatar_trainer.stages.bind import bind_skin
from avatar_trainer.stages.blend import Deltas, blend
from avatar_trainer.stages.rotation import polar
from avatar_trainer.stages.surface import embed, pose_mesh
from avatar_trainer.tensors import Gaussians
from tests.avatars import full_avatar
from tests.measured import Measure
from tests.trainer.stages.surfaces import NAMES, RULES, SurfaceCase, surface_case
from tests.trainer.tensors import ATTRIBUTES, deltas, gaussians, gradients, leaves, normal, relative

BASE, DELTAS = gaussians(full_avatar().gaussians), deltas(full_avatar().blendshapes)
WEIGHTS = torch.tensor([0.7, 0.0, -0.2, 1.3])
Run = Callable[..., Mapping[str, Tensor]]


def compared(kernel: Run, definition: Run, inputs: list[Tensor]) -> tuple[float, float]:
    """Largest relative differences of values and of gradients; the definition in float64."""
    single, double = leaves(inputs, torch.float32), leaves(inputs)
    expected = definition(*double)
    values = [relative(value, expected[name]) for name, value in kernel(*single).items()]
    pairs = zip(gradients(kernel, single), gradients(definition, double), strict=True)
    return max(values), max(relative(own, wanted) for own, wanted in pairs)


def same_bits(kernel: Run, inputs: list[Tensor]) -> bool:
    """Whether one thread and two give the same."""
    results = []
    for threads in (1, 2):
        with using(threads):
            single = leaves(inputs, torch.float32)
            results.append([*kernel(*single).values(), *gradients(kernel, single)])
    return all(torch.equal(a, b) for a, b in zip(*results, strict=True))


def blended(by: Callable[[Gaussians, Deltas, Tensor], Gaussians]) -> Run:
    def run(*values: Tensor) -> Mapping[str, Tensor]:
        base = Gaussians(**dict(zip(ATTRIBUTES, values[:5], strict=True)))
        delta = replace(DELTAS, **dict(zip(ATTRIBUTES, values[5:], strict=True)))
        return vars(by(base, delta, WEIGHTS.to(values[0].dtype)))

    return run


BLENDING = [getattr(part, name) for part in (BASE, DELTAS) for name in ATTRIBUTES]


def test_blend(measured: Measure) -> None:
    value, gradient = compared(blended(blend_cpu), blended(blend), BLENDING)
    measured("trainer kernel blend: largest relative difference of gradients", gradient)
    assert value <= 1e-6 and gradient <= 1e-6
    assert same_bits(blended(blend_cpu), BLENDING)


MATRIX = torch.eye(3, 4) + 0.2 * normal(0, 48, 3, 4).float()
CORRECTIVE, LATE = normal(1, 48, 3).float(), normal(2, 48, 3).float()


def skinned(rotation: Tensor | None, offsets: bool) -> tuple[Run, Run]:
    """(kernel, definition)."""
    extra = (CORRECTIVE, LATE) if offsets else (None, None)

    def kernel(*values: Tensor) -> Mapping[str, Tensor]:
        s = skinned_cpu(Gaussians(*values), MATRIX, rotation, *extra)
        assert s.sh_rotation is not None and not s.sh_rotation.requires_grad
        return {name: value for name, value in vars(s).items() if name != "sh_rotation"}

    def definition(*values: Tensor) -> Mapping[str, Tensor]:
        matrix = MATRIX.to(values[0].dtype)
        turn = polar(matrix[:, :, :3]) if rotation is None else rotation.to(values[0].dtype)
        bound, _ = bind_skin(
            Gaussians(*values), matrix, turn, *(e if e is None else e.double() for e in extra)
        )
        return {name: value for name, value in vars(activate(bound, None)).items() if name != "sh_rotation"}

    return kernel, definition


@pytest.mark.parametrize("offsets", [True, False])
@pytest.mark.parametrize("rotation", [None, polar(MATRIX[:, :, :3]).flip(0)], ids=["polar", "given"])
def test_skin(rotation: Tensor | None, offsets: bool, measured: Measure) -> None:
    inputs = list(vars(BASE).values())
    kernel, definition = skinned(rotation, offsets)
    value, gradient = compared(kernel, definition, inputs)
    measured("trainer kernel skin: largest relative difference of gradients", gradient)
    assert value <= 2e-6 and gradient <= 2e-6
    assert same_bits(kernel, inputs)


def embedded(given: SurfaceCase, vertices: Tensor, matrix: Tensor, rules: Rules) -> tuple[Run, Run]:
    """The kernel and the definition of Gaussians on one pose of the surface."""
    fast = pose_mesh_cpu(vertices, kernel_mesh(given.mesh), rules, matrix)
    plain = pose_mesh(vertices, given.mesh, rules, matrix)
    for name in ("vertices", "vertex_normal", "vertex_turn", "area"):
        assert relative(getattr(fast, name), getattr(plain, name)) <= 1e-6, name

    def kernel(*values: Tensor) -> Mapping[str, Tensor]:
        s = embedded_cpu(fast, given.mesh, given.triangle, *values, rules)
        assert s.sh_rotation is not None and not s.sh_rotation.requires_grad
        return vars(s)

    def definition(*values: Tensor) -> Mapping[str, Tensor]:
        under = pose_mesh(vertices.double(), given.mesh, rules, matrix)
        c = embed(under, given.mesh, given.triangle, *values[:4], rules)
        raw = Gaussians(c.mean, c.log_scale, c.quat_wxyz, *values[4:])
        return vars(activate(raw, c.rotation))

    return kernel, definition


@pytest.mark.parametrize("rules", RULES, ids=NAMES)
def test_surface(rules: Rules, measured: Measure) -> None:
    given = surface_case(rules)
    inputs = [*given.values(), BASE.opacity_logit, BASE.sh]
    for vertices, matrix in zip(given.posed[:3], given.matrix[:3], strict=True):
        kernel, definition = embedded(given, vertices, matrix, rules)
        value, gradient = compared(kernel, definition, inputs)
        measured("trainer kernel surface: largest relative difference of gradients", gradient)
        assert value <= 1e-5 and gradient <= 1e-5
        assert same_bits(kernel, inputs)


@pytest.mark.parametrize("size", [(40, 56), (1, 1), (3, 17), (30, 4)])
def test_ssim(size: tuple[int, int], measured: Measure) -> None:
    a = torch.sigmoid(normal(0, *size, 3))
    b = (a + 0.1 * normal(1, *size, 3)).float()

    def kernel(image: Tensor) -> Mapping[str, Tensor]:
        return {"ssim": ssim_cpu(image, b)}

    def definition(image: Tensor) -> Mapping[str, Tensor]:
        return {"ssim": ssim_definition(image, b.double())}

    value, gradient = compared(kernel, definition, [a])
    measured("trainer kernel ssim: largest relative difference of the gradient", gradient)
    assert value <= 2e-6 and gradient <= 2e-5
    assert same_bits(kernel, [a])


@pytest.mark.parametrize(
    ("changed", "weights", "message"),
    [
        ({"row_ptr": DELTAS.row_ptr[:-1]}, WEIGHTS, "row_ptr does not rise"),
        ({"row_ptr": DELTAS.row_ptr.flip(0)}, WEIGHTS, "row_ptr does not rise"),
        ({"row_ptr": DELTAS.row_ptr.int()}, WEIGHTS, "contiguous int64"),
        ({"column": DELTAS.column + 1}, WEIGHTS, "outside the 4 expression weights"),
        ({"column": DELTAS.column - 1}, WEIGHTS, "outside the 4 expression weights"),
        ({"mean": DELTAS.mean[:-1]}, WEIGHTS, "do not have"),
        ({"sh": DELTAS.sh.double()}, WEIGHTS, "float32 on the CPU"),
        ({}, WEIGHTS.clone().requires_grad_(), "no gradient for the expression weights"),
    ],
)
def test_blend_refuses_what_does_not_fit(changed: dict[str, Tensor], weights: Tensor, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        blend_cpu(BASE, replace(DELTAS, **changed), weights)


def test_skin_has_no_gradient_of_the_matrix() -> None:
    with pytest.raises(ValueError, match="bind_skin has the others"):
        skinned_cpu(BASE, MATRIX.clone().requires_grad_())


def test_surface_refuses_what_does_not_fit() -> None:
    rules = RULES[0]
    given = surface_case(rules)
    mesh = kernel_mesh(given.mesh)
    under = pose_mesh_cpu(given.posed[0], mesh, rules)
    rest = (*given.values(), BASE.opacity_logit, BASE.sh)
    for triangle in (given.triangle - 1, given.triangle + 1, given.triangle[:-1]):
        with pytest.raises(ValueError, match="one of 20 triangles"):
            embedded_cpu(under, given.mesh, triangle, *rest, rules)
    with pytest.raises(ValueError, match="no gradients"):
        pose_mesh_cpu(given.posed[0].clone().requires_grad_(), mesh, rules)
    moving = pose_mesh(given.posed[0].clone().requires_grad_(), given.mesh, rules)
    with pytest.raises(ValueError, match="no gradient for the mesh"):
        embedded_cpu(moving, given.mesh, given.triangle, *rest, rules)
    with pytest.raises(ValueError, match="is not trained"):
        pose_mesh_cpu(given.posed[0], mesh, replace(rules, quaternion_sign="largest_positive"))


def test_ssim_refuses_what_does_not_fit() -> None:
    image = torch.zeros(4, 5, 3)
    for a, b in ((image, image[:3]), (image[:, :, :2], image[:, :, :2]), (image[0], image[0])):
        with pytest.raises(ValueError, match="are needed"):
            ssim_cpu(a, b)
    with pytest.raises(ValueError, match="float32"):
        ssim_cpu(image.double(), image.double())
    with pytest.raises(ValueError, match="no gradient for its second"):
        ssim_cpu(image, image.clone().requires_grad_())
