from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest
import torch

from avatar_export.asm import maths
from avatar_export.asm.model import AsmFace, Take
from avatar_runtime.backends.cpu.threads import using
from avatar_trainer.asm.faces import posed_cpu, tiles
from avatar_trainer.asm.model import (
    Face,
    TemplateTensors,
    bone_positions,
    posed,
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
        "weights": (
            weights(template, face),
            maths.mixture_weight_rows(stored.template, stored.binding, slice(None)),
        ),
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


def test_what_is_stored_comes_back(stored: AsmFace) -> None:
    face, take = face_at(stored, 1)
    binding, again = face.binding(), face.take("neutral")
    for name in ("zeta", "pi", "mu", "covariance"):
        np.testing.assert_allclose(getattr(binding, name), getattr(stored.binding, name), atol=1e-12)
    for name in ("rotation_vector", "translation", "scale"):
        np.testing.assert_allclose(getattr(again, name), getattr(take, name), atol=1e-12)
    with pytest.raises(ValueError, match="positive definite"):
        Face.of(replace(stored.binding, covariance=-stored.binding.covariance))


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
