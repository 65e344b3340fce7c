"""Small captures on disk, one of each layout; the numbers they were made of come back with them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from PIL import Image

from avatar_runtime.avatar import Rig
from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.own import Shot, write
from tests.exporter.bodies import body_files

Array = npt.NDArray[Any]
WIDTH, HEIGHT = 12, 10
FRAMES = 6
K = np.array([[40.0, 0.0, 6.5], [0.0, 41.0, 4.5], [0.0, 0.0, 1.0]])
AHEAD = np.array([0.0, 0.0, 1.0])
RIGHTS = {"source": "synthetic", "licence": "CC0", "author": "nobody", "consent": "none is needed"}


def body_folder(folder: Path) -> dict[str, Array]:
    """body.npz, shape.npy, eyelids and anchor faces of a small FLAME; its arrays."""
    folder.mkdir(parents=True)
    model = body_files.body(body_files.FLAME_PARENTS)
    body_files.write_body(folder / "body_model.npz", model)
    rng = np.random.default_rng(2)
    model["shape"] = rng.normal(0, 1, body_files.IDENTITY)
    np.save(folder / "shape.npy", model["shape"])
    for side in "lr":
        model[f"{side}_eyelid"] = rng.normal(0, 0.01, model["v_template"].shape)
        np.save(folder / f"{side}_eyelid.npy", model[f"{side}_eyelid"])
    (folder / "back_of_head.txt").write_text("3 4 5\n3")
    return model


def rotation(seed: int) -> Array:
    """Some rotation [3, 3]."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.linalg.det(q)


def image(seed: int) -> Array:
    return np.random.default_rng(seed).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)


def mask(seed: int) -> Array:
    return np.random.default_rng(100 + seed).integers(0, 256, (HEIGHT, WIDTH), np.uint8)


def shot(t: int, **changed: Any) -> Shot:
    rng = np.random.default_rng(200 + t)
    fields: dict[str, Any] = {
        "image": image(t),
        "mask": mask(t),
        "intrinsics": K,
        "rotation": rotation(t),
        "translation": rng.normal(0, 0.1, 3) + AHEAD,
        "expression": rng.normal(0, 1, 2).astype(np.float32),
        "joints": {"jaw": rng.normal(0, 0.3, 3), "neck": _delta(t)},
        "eyelids": rng.uniform(0, 1, 2).astype(np.float32),
        "world_from_avatar": _delta(50 + t),
    }
    return Shot(**(fields | changed))


def own(folder: Path, count: int = FRAMES) -> Path:
    """A capture of the own layout whose rows name expressions 2 and 0 of three, and the right lid before the left."""
    body_folder(folder / "body")
    write(
        folder,
        name="small",
        fps=30,
        head_pose_in="camera",
        expressions=("exp_002", "exp_000"),
        eyelids=("right", "left"),
        poses="estimated",
        body={
            "kind": "body_model",
            "model": "body/body_model.npz",
            "shape": "body/shape.npy",
            "eyelids": "body",
            "anchor_faces": "body/back_of_head.txt",
        },
        frames=((f"{t:03d}", shot(t)) for t in range(count)),
        **dict(zip(("source", "license", "author", "consent"), RIGHTS.values(), strict=True)),
    )
    return folder


def changed(folder: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """`folder` with its capture.json changed."""
    file = folder / "capture.json"
    document = json.loads(file.read_text())
    change(document)
    file.write_text(json.dumps(document))
    return folder


def tracked(folder: Path, count: int = FRAMES) -> tuple[Path, dict[str, Array]]:
    """A metrical-tracker capture beside its body, in INSTA's variant; the body's arrays."""
    model = body_folder(folder / "body")
    data = folder / "take"
    (data / "checkpoint").mkdir(parents=True)
    (data / "images").mkdir()
    for t in range(count):
        torch.save(frame(model["shape"], t), data / "checkpoint" / f"{t:05d}.frame")
        Image.fromarray(np.dstack([image(t), mask(t)])).save(data / "images" / f"{t:05d}.png")
    return data, model


def frame(shape: Array, t: int) -> dict[str, Any]:
    """What the tracker saves of frame t: 6D rotations that are neither unit nor orthogonal."""
    rng = np.random.default_rng(300 + t)
    row = rng.normal(size=(3, 6)) + 2 * np.eye(2, 3).ravel()
    flame = {
        "exp": rng.normal(0, 1, (1, 3)),
        "shape": shape[None],
        "eyes": row[1:].reshape(1, 12),
        "eyelids": rng.uniform(0, 1, (1, 2)),
        "jaw": row[:1],
    }
    opencv = {"R": rotation(t)[None], "t": rng.normal(0, 0.1, (1, 3)) + AHEAD, "K": K[None]}
    return {
        "flame": {name: value.astype(np.float32) for name, value in flame.items()},
        "opencv": {name: value.astype(np.float32) for name, value in opencv.items()},
        "img_size": np.array([HEIGHT, WIDTH]),
        "frame_id": f"{t:05d}",
    }


def imavatar(folder: Path) -> tuple[Path, dict[str, Array], dict[str, Array]]:
    """An IMavatar capture with its body inside; the body's arrays, and the poses with world_mat [T, 3, 4]."""
    folder.mkdir()
    model, p = body_folder(folder / "body"), body_files.poses(5)
    p["shape"], p["translation"] = model["shape"], p["translation"] * 0
    file = body_files.flame_json(folder / "flame_params.json", p)
    document = json.loads(file.read_text())
    p["world_mat"] = np.stack(
        [np.column_stack([rotation(t), [0.1 * t, -0.2, -4.0]]) for t in range(body_files.FRAMES)]
    )
    for t, entry in enumerate(document["frames"]):
        entry["world_mat"] = p["world_mat"][t].tolist()
    document["intrinsics"] = [-2.5, 3.0, 0.52, 0.48]
    file.write_text(json.dumps(document))
    for part, pixels in (("image", image), ("mask", mask)):
        (folder / part).mkdir()
        for t in range(body_files.FRAMES):
            Image.fromarray(pixels(t)).save(folder / part / f"{t}.png")
    return folder, model, p


def posed(rig: Rig, pose: PoseArrays) -> Array:
    """Posed vertices [V, 3]."""
    return posed_mesh(rig, pose, joints(rig, pose))


def _delta(seed: int) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(1000 + seed)
    matrix[:3, 3] = np.random.default_rng(seed).normal(0, 0.01, 3)
    return matrix
