"""The kernel of mixture weights against `asm_model.weights`, its definition, in float64."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from avatar_trainer.asm.kernels.mixture import mixture_weights_cpu
from avatar_trainer.asm.model import Face, TemplateTensors, weights
from tests.measured import Measure
from tests.trainer.asm.toy import binding, template

FIELDS = ("zeta", "pi_logit", "mu", "scale_tril")


def a_face(components: int, dtype: torch.dtype) -> Face:
    """The toy's, every number of it changed."""
    random = torch.Generator().manual_seed(4)
    face = Face.of(binding(template(), components), dtype=torch.float64)
    for name, size in zip(FIELDS, (0.05, 0.5, 0.05, 0.3), strict=True):
        value = getattr(face, name)
        value = value + size * torch.randn(value.shape, generator=random, dtype=torch.float64)
        setattr(face, name, value.to(dtype).requires_grad_())
    return face


def both(components: int) -> tuple[list[Tensor], list[Tensor]]:
    """Values and gradients by the kernel and by the definition."""
    results = []
    for dtype in (torch.float32, torch.float64):
        face, tensors = a_face(components, dtype), TemplateTensors.of(template(), dtype)
        if dtype == torch.float32:
            found = mixture_weights_cpu(
                tensors.uv, face.pi_logit, face.mu + face.zeta[:, None], face.scale_tril
            )
        else:
            found = weights(tensors, face)
        outer = torch.randn(found.shape, generator=torch.Generator().manual_seed(5), dtype=torch.float64)
        (found * outer.to(dtype)).sum().backward()  # type: ignore[no-untyped-call]
        results.append([found.detach(), *(getattr(face, name).grad for name in FIELDS)])
    return results[0], results[1]


@pytest.mark.parametrize("components", [1, 2, 5])
def test_values_and_gradients_are_those_of_the_definition(components: int, measured: Measure) -> None:
    own, expected = both(components)
    for part, wanted in zip(own, expected, strict=True):
        off = float((part - wanted).abs().max() / wanted.abs().max().clamp_min(1))
        assert off < 2e-5
        measured("mixture weights kernel against the definition, relative to the largest", off)


def test_a_callers_mistakes_are_refused() -> None:
    face, tensors = a_face(2, torch.float32), TemplateTensors.of(template())
    rest = face.pi_logit, face.mu, face.scale_tril
    with pytest.raises(ValueError, match="no gradient for uv"):
        mixture_weights_cpu(tensors.uv.clone().requires_grad_(), *rest)
    with pytest.raises(ValueError, match="float32"):
        mixture_weights_cpu(tensors.uv.double(), *rest)
