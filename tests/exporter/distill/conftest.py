"""Small dumps of the project's own avatars, made once a run."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from samples.dumps import random_poses, write_dumps

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.dumps.folder import DOCUMENT, open_dumps
from avatar_export.distill.dumps.frames import layout, read_frame
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.bundle import load
from avatar_runtime.codec import ply
from avatar_runtime.pose import Pose
from avatar_runtime.stages.activate import Splats
from avatar_runtime.subset import subset
from tests.session.shared_folder import made_once

TRAINED = Path(__file__).parents[3] / "samples" / "trained"


@pytest.fixture(scope="session")
def small_head() -> Avatar:
    """A few Gaussians of the trained Gaussian Blendshapes head, with its whole rig."""
    head = load(TRAINED / "head_blendshapes")
    rows = np.arange(0, head.gaussians.count, 20)
    return subset(head, rows, head.rig.anchor_vertices).avatar


@pytest.fixture(scope="session")
def small_body() -> Avatar:
    """A few Gaussians of the trained SplattingAvatar body, with its whole mesh."""
    body = load(TRAINED / "body_splatting")
    return subset(body, np.arange(0, body.gaussians.count, 60), np.arange(len(body.rig.vertices))).avatar


@pytest.fixture(scope="session")
def head_dumps(small_head: Avatar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Dumps of the head: 120 random poses, and 8 more that are held out; not to be changed."""
    takes = [random_poses(small_head, 120, 8.0), random_poses(small_head, 8, 8.0, seed=8)]
    rights = {"licence": "CC BY 4.0", "consent": "signed"}
    return made_once(
        tmp_path_factory, "head_dumps", lambda folder: write_dumps(small_head, takes, folder, **rights)
    )


@pytest.fixture(scope="session")
def body_dumps(small_body: Avatar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Dumps of the body: 30 random poses, and 4 more that are held out; not to be changed."""
    takes = [random_poses(small_body, 30, 15.0), random_poses(small_body, 4, 15.0, seed=8)]
    return made_once(tmp_path_factory, "body_dumps", lambda folder: write_dumps(small_body, takes, folder))


@pytest.fixture
def few(small_head: Avatar, tmp_path: Path) -> Path:
    """Six frames of the head, for tests that spoil them."""
    poses = random_poses(small_head, 6, 3.0)
    return write_dumps(small_head, [poses[:4], poses[4:]], tmp_path / "few")


def bent(splats: Splats, pose: Pose) -> Splats:
    """A network's work: positions move by a product of weights."""
    amount = np.prod([1 + weight for weight in pose.expressions.values()]) - 1
    wave = np.sin(np.arange(len(splats.mean)))[:, None] * [0.0, 0.0, 1.0]
    return replace(splats, mean=splats.mean + (0.004 * np.tanh(amount) * wave).astype(np.float32))


def edited(folder: Path, **changes: Any) -> Path:
    """`folder` with other values in dumps.json; a nested one as encoding__scale. None removes a key."""
    file = folder / DOCUMENT
    document = json.loads(file.read_text("utf-8"))
    for key, value in changes.items():
        *outer, name = key.split("__")
        part = document
        for step in outer:
            part = part[step]
        part[name] = value
        if value is None:
            del part[name]
    file.write_text(json.dumps(document), "utf-8")
    return folder


def with_arrays(folder: Path, **changes: Any) -> Path:
    """`folder` with other arrays in drivers.npz; None removes one."""
    with np.load(folder / DRIVERS) as stored:
        arrays = {**stored, **changes}
    np.savez(folder / DRIVERS, **{name: array for name, array in arrays.items() if array is not None})
    return folder


def rewritten(file: Path, change: Callable[[F32, list[str]], F32]) -> None:
    """The rows of a .ply changed by `change(matrix, names)`, which returns the new rows."""
    data = file.read_bytes()
    head = ply.header(data, len(data))
    names = list(head.dtype.names or ())
    matrix = np.frombuffer(data, "<f4", offset=head.offset).reshape(head.rows, len(names)).copy()
    matrix = change(matrix, names)
    text = data[: head.offset].replace(b"vertex %d" % head.rows, b"vertex %d" % len(matrix))
    file.write_bytes(text + matrix.astype("<f4").tobytes())


def swapped(folder: Path, frames: Iterable[int]) -> NDArray[np.int64]:
    """The order of the Gaussians in these frames, which has the lowest and the highest in each other's place."""
    dumps = open_dumps(folder)
    known = layout(dumps.frame(0), dumps.encoding)
    height = read_frame(dumps, known, 0).mean[0, :, 1]
    two = [int(height.argmin()), int(height.argmax())]
    order = np.arange(known.rows)
    order[two] = order[two[::-1]]
    for frame in frames:
        rewritten(folder / "frames" / f"{frame:05d}.ply", lambda rows, _: rows[order])
    return order


def copied(folder: Path, to: Path) -> Path:
    """A copy that a test may change."""
    return Path(shutil.copytree(folder, to))
