"""A head with a mole on the person's left cheek, as packs of both handednesses.

    python -m tests.players.mirrors.mole

writes them. The picture of a head is nearly its own mirror image. This one shows which side is which: the mole, the
smile, the colours that depend on the direction, the place where a camera looks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.packing.write import driving_facts, prepare, write
from avatar_runtime.avatar import F32, Avatar, Blendshapes, Driving, Expression, Gaussians, Group, SparseRows
from avatar_runtime.camera import Camera
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.handedness import HANDEDNESS, mirrored
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import avatar_of, rig_of

FOLDER = Path(__file__).parents[2] / "data" / "mole"
SKIN = 240  # Gaussians of the head; then the mole, and the corners of the mouth
MOLE, LEFT_CORNER, RIGHT_CORNER = SKIN, SKIN + 1, SKIN + 2
COUNT = SKIN + 3
HALF = np.array([0.08, 0.11, 0.09])  # of the head, metres
SHIFT = np.array([0.05, 0.0, 0.0])  # the head does not lie on the plane in which it is mirrored
PLACES = {MOLE: (0.05, -0.01, 0.09), LEFT_CORNER: (0.032, -0.065, 0.09), RIGHT_CORNER: (-0.032, -0.065, 0.09)}
COLOURS = {MOLE: (0.9, 0.0, 0.0), LEFT_CORNER: (0.0, 0.9, 0.0), RIGHT_CORNER: (0.0, 0.0, 0.9)}
HEIGHTS = (None, 60.0)  # `height_px` of its levels
SIZE = (120, 140)
DC = 0.28209479177387814  # spherical harmonic of degree 0


def mole_avatar() -> Avatar:
    """The head, right-handed: +X is its left. `mouthSmileLeft` lifts the left corner of its mouth, `neck` turns it."""
    rng = np.random.default_rng(5)
    tiny = avatar_of((Expression("mouthSmileLeft"),), _rig(), Driving("names", head_joint="neck"))
    assert tiny.rig is not None
    smile = SparseRows(
        np.repeat(np.array([0, 1], np.uint32), [LEFT_CORNER + 1, COUNT - LEFT_CORNER]),
        np.zeros(1, np.uint16),
        {"mean": np.array([[0.008, 0.03, 0.0]], np.float32), "quat_wxyz": np.zeros((1, 4), np.float32)},
        1,
    )
    whole = SparseRows(
        np.arange(COUNT + 1, dtype=np.uint32),
        np.ones(COUNT, np.uint16),
        {"weight": np.ones(COUNT, np.float32)},
        2,
    )
    return check_avatar(
        replace(
            tiny,
            name="mole",
            provenance={"system": "made_for_tests"},
            gaussians=_gaussians(rng),
            groups=(Group("face", 0, COUNT, "skin"),),
            blendshapes=Blendshapes(
                smile,
                SparseRows.empty(COUNT, 1, {"log_scale": (3,), "opacity_logit": (), "sh": (4, 3)}),
                SparseRows.empty(COUNT, 0, {"mean": (3,)}),
                SparseRows.empty(COUNT, 0, {"mean": (3,)}),
            ),
            skin=whole,
            sh_degree=1,
        )
    )


def mole_files() -> dict[str, bytes]:
    """Its pack in both frames, each of two levels."""
    whole = {"target": SHIFT.tolist(), "size": (2.2 * HALF).tolist()}
    avatar, files = mole_avatar(), {}
    for name in HANDEDNESS:
        own = avatar if name == "right" else mirrored(avatar)
        x, y, z = whole["target"]
        target = [x if name == "right" else -x, y, z]
        framing = {"up": [0.0, 1.0, 0.0], "front": [0.0, 0.0, 1.0], "whole": {**whole, "target": target}}
        levels = [{"height_px": height} for height in HEIGHTS]
        facts = {"framing": framing, "levels": levels, **driving_facts(own)}
        files[name] = write(prepare([own, own], None), facts, None, name).file
    return files


def mole_pose() -> Pose:
    """It smiles on its left, and looks to its left and down."""
    neck = homogeneous(matrix_from_rotvec(np.array([0.15, 0.35, 0.05])), np.zeros(3))
    return Pose({"mouthSmileLeft": 1.0}, joints={"neck": neck})


def mole_camera(size: tuple[int, int] = SIZE) -> Camera:
    """Before its face, turned a little to its left."""
    return Camera.orbit(SHIFT, 0.6, 0.2, 0.1, 0.5, *size)


def sides(image: npt.NDArray[Any]) -> Mapping[str, tuple[float, float]]:
    """Where the mole and both corners of the mouth are in an image [H, W, 3 or more]: column and row from its centre,
    as shares of its size."""
    found = {}
    for name, colour in (("mole", 0), ("left", 1), ("right", 2)):
        others = [c for c in range(3) if c != colour]
        weight = np.clip(image[..., colour] - image[..., others].max(axis=-1) - 0.15, 0, None)
        assert weight.sum() > 0.1, name
        rows, columns = np.indices(weight.shape)
        height, width = weight.shape
        found[name] = (
            float((weight * columns).sum() / weight.sum() / (width - 1) - 0.5),
            float((weight * rows).sum() / weight.sum() / (height - 1) - 0.5),
        )
    return found


def _rig() -> Any:
    local = np.tile(np.eye(4), (2, 1, 1))
    local[0, :3, 3], local[1, :3, 3] = SHIFT - (0.0, 0.15, 0.0), (0.0, 0.05, -0.02)
    rig = rig_of(("root", "neck"), [-1, 0], local)
    world = np.stack([local[0], local[0] @ local[1]])
    return replace(rig, inverse_bind_matrix=np.linalg.inv(world).astype(np.float32))


def _gaussians(rng: np.random.Generator) -> Gaussians:
    turn = np.arange(SKIN) * (np.pi * (3 - np.sqrt(5)))
    up = 1 - 2 * (np.arange(SKIN) + 0.5) / SKIN
    ring = np.sqrt(1 - up**2)
    mean = HALF * np.stack([ring * np.sin(turn), up, ring * np.cos(turn)], axis=1)
    mean = np.concatenate([mean, [PLACES[at] for at in range(SKIN, COUNT)]]) + SHIFT
    log_scale = np.full((COUNT, 3), np.log(0.008)) + 0.2 * rng.standard_normal((COUNT, 3))
    log_scale[SKIN:] = np.log(0.007)
    sh = np.zeros((COUNT, 4, 3))
    colours = np.full((COUNT, 3), 0.5)
    colours[SKIN:] = [COLOURS[at] for at in range(SKIN, COUNT)]
    sh[:, 0] = (colours - 0.5) / DC
    sh[:SKIN, 1:] = 0.12 * rng.standard_normal((SKIN, 3, 1))  # greys that change with the direction
    arrays: list[F32] = [a.astype(np.float32) for a in (mean, log_scale, rng.standard_normal((COUNT, 4)))]
    return Gaussians(*arrays, np.full(COUNT, 3.0, np.float32), sh.astype(np.float32))


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, data in mole_files().items():
        (FOLDER / f"{name}.avatar").write_bytes(data)
