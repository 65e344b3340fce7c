from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest
import torch

from avatar_export.asm import maths
from avatar_export.asm.model import AsmFace, Binding, Take, Template
from avatar_runtime.backends.cpu.threads import using
from avatar_trainer.asm.faces import posed_cpu, tiles
from avatar_trainer.asm.model import (
    VARIANTS,
    Face,
    TemplateTensors,
    bone_positions,
    posed,
    random_mixtures,
    rotation_matrices,
    skin_matrices,
    weights,
)
from tests.asm_faces import small_face
from tests.measured import Measure


@pytest.fixture(scope="module")
def stored() -> AsmFace:
    """With weights pi that add up to 1 in float64 as well: files round them to float32."""
    face = small_face()
    pi = face.binding.pi / face.binding.pi.sum(axis=1, keepdims=True)
    return replace(face, binding=replace(face.binding, pi=pi))


def face_at(stored: AsmFace, frame: int, dtype: torch.dtype = torch.float64) -> tuple[Face, Take]:
    take = maths.one_frame(stored.takes[-1], frame)
    return Face.of(stored.binding, take, dtype), take


def batch(stored: AsmFace, count: int, dtype: torch.dtype, seed: int = 3) -> Face:
    generator = torch.Generator().manual_seed(seed)
    face, _ = face_at(stored, 0, dtype)
    return Face(
        **{
            name: tensor + 0.02 * torch.randn((count, *tensor.shape), generator=generator, dtype=dtype)
            for name, tensor in face.parameters()
        }
    )


def one_of(faces: Face, row: int) -> Face:
    return Face(**{name: tensor[row] for name, tensor in faces.parameters()})


@pytest.mark.parametrize("rule", ["normalised", "softplus"])
def test_is_the_exporters_model(stored: AsmFace, rule: str, measured: Measure) -> None:
    stored = replace(stored, template=replace(stored.template, weight_rule=rule))
    template = TemplateTensors.of(stored.template, torch.float64)
    face, take = face_at(stored, len(stored.takes[-1].scale) - 1)
    pairs = {
        "weights": (weights(template, face), maths.mixture_weights(stored.template, stored.binding)),
        "bones m": (bone_positions(template, face), maths.bone_positions(stored.template, stored.binding)),
        "matrices": (skin_matrices(template, face), maths.skin_matrices(stored, take)[0, :, :3]),
        "vertices m": (posed(template, face), maths.posed(stored, take)),
    }
    for name, (here, there) in pairs.items():
        apart = float(np.abs(here.numpy() - there).max())
        measured(f"asm torch against numpy, {name}", apart, 1e-12)
        assert apart < 1e-12, name


def test_every_parameter_has_its_gradient(stored: AsmFace) -> None:
    rows = np.arange(0, len(stored.template.vertices))[:40]
    template = TemplateTensors.of(stored.template, torch.float64)
    faces = batch(stored, 2, torch.float64)
    faces.zeta[1, 2] = torch.tensor([1.3, 0.4])  # outside the chart
    faces.rotation_vector[0, 0] = 0
    given = [tensor.requires_grad_() for _, tensor in faces.parameters()]
    assert torch.autograd.gradcheck(
        lambda *parts: posed(template, Face(*parts))[:, rows], given, fast_mode=True
    )
    assert torch.autograd.gradcheck(
        lambda v: rotation_matrices(v), (torch.zeros(1, 3).double().requires_grad_(),)
    )


def test_zeta_moves_bones_and_weights(stored: AsmFace) -> None:
    template = TemplateTensors.of(stored.template, torch.float64)
    face, _ = face_at(stored, 0)
    face.zeta.requires_grad_()
    (by_bone,) = torch.autograd.grad(bone_positions(template, face).square().sum(), face.zeta)
    (by_weight,) = torch.autograd.grad(weights(template, face).square().sum(), face.zeta)
    assert (by_bone.abs().sum(1) > 0).all()
    assert (by_weight.abs().sum(1) > 0).all()


def test_what_is_stored_comes_back(stored: AsmFace) -> None:
    face, take = face_at(stored, 1)
    binding, again = face.binding(), face.take("neutral")
    for name in ("zeta", "pi", "mu", "covariance"):
        np.testing.assert_allclose(getattr(binding, name), getattr(stored.binding, name), atol=1e-12)
    for name in ("rotation_vector", "translation", "scale"):
        np.testing.assert_allclose(getattr(again, name), getattr(take, name), atol=1e-12)
    with pytest.raises(ValueError, match="positive definite"):
        Face.of(replace(stored.binding, covariance=-stored.binding.covariance))


def test_far_from_all_bones_weights_still_add_up(stored: AsmFace) -> None:
    far = replace(stored.template, uv=stored.template.uv + 100)
    share = weights(TemplateTensors.of(far), Face.of(stored.binding))
    torch.testing.assert_close(share.sum(-1), torch.ones(len(share)))


def test_many_at_once_are_the_same_faces(stored: AsmFace, measured: Measure) -> None:
    faces, template = batch(stored, 5, torch.float32), TemplateTensors.of(stored.template)
    prepared = tiles(template)
    fast = posed_cpu(template, faces, prepared)
    for row in range(5):
        apart = float((fast[row] - posed(template, one_of(faces, row))).abs().max())
        measured("asm posed_cpu against asm_model m", apart, 1e-6)
        assert apart < 1e-6
    for threads in (1, numba.config.NUMBA_NUM_THREADS):
        with using(threads):
            assert torch.equal(fast, posed_cpu(template, faces, prepared))


def test_the_fast_way_refuses_the_other_rule(stored: AsmFace) -> None:
    template = TemplateTensors.of(replace(stored.template, weight_rule="softplus"))
    with pytest.raises(ValueError, match="normalised"):
        posed_cpu(template, batch(stored, 1, torch.float32), tiles(template))


def test_a_chain_of_bones_by_hand() -> None:
    """Two bones: the parent turns a quarter about z, the child grows in x: worked out on paper."""
    eye = np.tile(np.eye(3, dtype=np.float32), (2, 1, 1))
    template = Template(
        vertices=np.float32([[0, 0, 0], [2, 0, 0], [0, 2, 0]]),
        triangles=np.uint32([[0, 1, 2]]),
        uv=np.float32([[0, 0], [1, 0], [0, 1]]),
        bone_names=("root", "child"),
        parents=np.int32([-1, 0]),
        rest_position=np.float32([[0, 0, 0], [1, 0, 0]]),
        rest_linear=eye,
        anchor_vertex=np.uint32([0, 0]),
    )
    unit = np.tile([1.0, 0.0, 1.0], (2, 1, 1))
    binding = Binding(np.zeros((2, 2)), np.ones((2, 1)), np.zeros((2, 1, 2)), unit)
    take = Take("neutral", 30.0, np.float64([[[0, 0, np.pi / 2], [0, 0, 0]]]), np.zeros((1, 2, 3)),
                np.float64([[[1, 1, 1], [3, 1, 1]]]))  # fmt: skip
    matrix = skin_matrices(TemplateTensors.of(template), Face.of(binding, take))
    # (2, 0, 0) is 1 from the child in x: 3 after growing, at (4, 0, 0); then a quarter turn about the origin.
    moved = matrix[1, :, :3] @ torch.tensor([2.0, 0, 0]) + matrix[1, :, 3]
    torch.testing.assert_close(moved, torch.tensor([0.0, 4.0, 0.0]), atol=1e-6, rtol=0)


def test_random_mixtures_are_the_seeds(stored: AsmFace) -> None:
    face, _ = face_at(stored, 0, torch.float32)
    one, two = (random_mixtures(face, torch.Generator().manual_seed(7)) for _ in range(2))
    assert torch.equal(one.mu, two.mu) and not torch.equal(one.mu, face.mu)
    assert VARIANTS["random_weights"].random_mixtures and not VARIANTS["full"].random_mixtures
