"""The released code's head, its checkpoint and its expressions."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch

from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.subject_files import read_eyelids, read_faces
from avatar_runtime.avatar import Rig
from avatar_trainer.systems.gaussian_blendshapes.mesh import Expressions
from tests.golden import BlendshapesGolden

Array = npt.NDArray[Any]
K = 50


@pytest.fixture(scope="module")
def rig(blendshapes_golden: BlendshapesGolden) -> Rig:
    """The body of the released code's numbers, with its subject's identity."""
    body = read_body_model(blendshapes_golden.body / "body_model.npz")
    faces = read_faces(blendshapes_golden.body / "back_of_head.txt", len(body.triangles))
    lids = read_eyelids(blendshapes_golden.body, body.vertex_count)
    return bake_rig(body, blendshapes_golden.frame(0)["shape"], lids, faces)


@pytest.fixture(scope="module")
def released(blendshapes_golden: BlendshapesGolden) -> dict[str, Array]:
    """acc*.npy, and the triangle and barycentric weights of the points that its rows came from."""
    stored = np.load(blendshapes_golden.raw / "acc40000.npy", allow_pickle=True).item()
    items, _ = torch.load(
        blendshapes_golden.raw / "fix_chkpnt40000.pth", weights_only=True, map_location="cpu"
    )
    body = blendshapes_golden.body_model()
    triangle, barycentric = items[15].numpy(), items[16].numpy().astype(np.float64)
    # Which point a row is a copy of: its pose correctives tell the triangle.
    fields = body["posedirs"][body["faces"][triangle]].sum(axis=1).reshape(len(triangle), -1)
    own = np.moveaxis(stored["pose_blendshape"], 0, -1).reshape(len(stored["W"]), -1)
    distance = np.abs(own[:, None, :6] - fields[None, :, :6]).sum(axis=2)
    alone = np.isin(triangle, [t for t in np.unique(triangle) if np.sum(triangle == t) == 1])
    point = distance.argmin(axis=1)
    return {
        **stored,
        "triangle": triangle[point],
        "barycentric": barycentric[point],
        "point_known": alone[point],  # no other point lies on that triangle
    }


@pytest.fixture(scope="module")
def expressions(rig: Rig) -> Expressions:
    return Expressions.of(rig, K)
