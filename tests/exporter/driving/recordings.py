"""The two real recordings and a small avatar for the driving tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Driving,
    Expression,
    Gaussians,
    Group,
    Rig,
    Rules,
    SparseRows,
)
from tests.shared_data import ROOT, shared

CSV = "live_link_face_rom_300.csv"
UDP = "live_link_face_udp.gesichter"


def recording(name: str) -> Path:
    """The committed sample if it is there, else the optional test data's copy (or a skip)."""
    sample = ROOT / "samples" / "drive" / name
    return sample if sample.exists() else shared(f"drive/{name}")


def rig_of(names: tuple[str, ...], parents: list[int], rest_local: np.ndarray) -> Rig:
    """A rig of one triangle with these joints."""
    joints = len(names)
    none = {"position": (3,)}
    return Rig(
        vertices=np.eye(3, dtype=np.float32),
        triangles=np.array([[0, 1, 2]], np.uint32),
        morphs=SparseRows.empty(3, 0, none),
        correctives=SparseRows.empty(3, 0, none),
        late_morphs=SparseRows.empty(3, 0, none),
        skin=SparseRows.empty(3, joints, {"weight": ()}),
        joint_names=names,
        parents=np.array(parents, np.int32),
        rest_local=rest_local.astype(np.float32),
        inverse_bind_matrix=np.tile(np.eye(4, dtype=np.float32), (joints, 1, 1)),
        joint_basis=np.zeros((0, joints, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )


def avatar_of(
    expressions: tuple[str | Expression, ...] = (),
    rig: Rig | None = None,
    driving: Driving | None = None,
    eyelids: tuple[str, ...] = (),
) -> Avatar:
    """One Gaussian that nothing moves, with these names to drive."""
    named = tuple(e if isinstance(e, Expression) else Expression(e) for e in expressions)
    joints = rig.joint_count if rig else 0
    if rig:
        rig = replace(
            rig,
            morphs=SparseRows.empty(3, len(named), {"position": (3,)}),
            late_morphs=SparseRows.empty(3, len(eyelids), {"position": (3,)}),
            joint_basis=np.zeros((len(named), joints, 3), np.float32),
        )
    return Avatar(
        name="tiny",
        gaussians=Gaussians(
            *(np.zeros((1, k), np.float32) for k in (3, 3, 4)),
            np.zeros(1, np.float32),
            np.zeros((1, 1, 3), np.float32),
        ),
        groups=(Group("all", 0, 1, "none"),),
        rules=Rules(),
        expressions=named,
        late_morph_names=eyelids,
        blendshapes=Blendshapes(
            SparseRows.empty(1, len(named), {"mean": (3,), "quat_wxyz": (4,)}),
            SparseRows.empty(1, len(named), {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}),
            SparseRows.empty(1, 0, {"mean": (3,)}),
            SparseRows.empty(1, len(eyelids), {"mean": (3,)}),
        ),
        skin=SparseRows.empty(1, joints, {"weight": ()}),
        rig=rig,
        sh_degree=0,
        driving=driving or Driving(mode="names"),
    )
