"""A capture of the own layout, written again as VHAP exports one: another world, another place for the head's pose."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from tests.oracles.lbs import rodrigues

Array = npt.NDArray[Any]
TEETH = 120  # vertices that VHAP appends


def write(take: Path, folder: Path, offset: Array | None = None) -> Path:
    """The capture `take`, with root and neck at rest and the body at take/body, as a VHAP export in `folder`.

    Each head is turned about the root joint and moved, and its camera with it. `offset` [V, 3] becomes the static
    offset.
    """
    document = json.loads((take / "capture.json").read_text())
    model = np.load(take / "body" / "body_model.npz")
    names = [str(name) for name in model["expression_names"]]
    columns = [names.index(name) for name in document["expressions"]]
    template = model["v_template"] + (0 if offset is None else offset)
    root = (model["J_regressor"] @ template)[0]
    rng = np.random.default_rng(4)
    entries = []
    for t, frame in enumerate(document["frames"]):
        turn, move = rng.normal(0, 0.4, 3), rng.normal(0, 0.1, 3)
        expression = np.zeros(len(names))
        expression[columns] = frame["expression"]
        values = {
            "translation": move,
            "rotation": turn,
            "neck_pose": np.zeros(3),
            "jaw_pose": frame["joints"]["jaw"],
            "eyes_pose": [*frame["joints"]["leftEye"], *frame["joints"]["rightEye"]],
            "expr": expression,
        }
        number = f"{t:05d}"
        _parameters(folder / "flame_param" / f"{number}.npz", values, offset)
        _pictures(take, frame, folder, f"{number}_00.png")
        entries.append(
            {
                "timestep_index": t,
                "camera_index": 0,
                "camera_id": "0",
                "transform_matrix": _transform(frame["camera"], turn, move, root).tolist(),
                "file_path": f"images/{number}_00.png",
                "fg_mask_path": f"fg_masks/{number}_00.png",
                "flame_param_path": f"flame_param/{number}.npz",
                **_intrinsics(document, frame["camera"]),
            }
        )
    canonical = {"expr": np.zeros(len(names)), "eyes_pose": np.zeros(6), "jaw_pose": [0.3, 0, 0]}
    still = dict.fromkeys(("translation", "rotation", "neck_pose"), np.zeros(3))
    _parameters(folder / "canonical_flame_param.npz", {**still, **canonical}, offset)
    shutil.copytree(take / "body", folder / "body")
    test = [t for t, frame in enumerate(document["frames"]) if frame["split"] == "test"]
    train = [e for t, e in enumerate(entries) if t not in test]
    parts = {"train": train, "test": [entries[t] for t in test], "val": []}
    for part, listed in parts.items():
        (folder / f"transforms_{part}.json").write_text(json.dumps({"frames": listed}))
    (folder / "transforms.json").write_text(json.dumps({"frames": entries}))
    return folder


def _parameters(file: Path, values: dict[str, Any], offset: Array | None) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    arrays = {name: np.asarray(value, np.float32)[None] for name, value in values.items()}
    arrays["shape"] = np.zeros(300, np.float32)
    if offset is not None:
        arrays["static_offset"] = np.concatenate([offset, np.ones((TEETH, 3))])[None].astype(np.float32)
    np.savez(file, **arrays)


def _pictures(take: Path, frame: dict[str, Any], home: Path, name: str) -> None:
    """The image over white, and its mask."""
    image, mask = (np.asarray(Image.open(take / frame[part])).astype(float) for part in ("image", "mask"))
    share = mask[:, :, None] / 255
    for part, pixels in (("images", image * share + 255 * (1 - share)), ("fg_masks", mask)):
        (home / part).mkdir(parents=True, exist_ok=True)
        Image.fromarray(np.rint(pixels).astype(np.uint8)).save(home / part / name)


def _transform(camera: dict[str, Any], turn: Array, move: Array, root: Array) -> Array:
    """World from camera, OpenGL, in the world in which the head is turned about its root and moved."""
    view, motion = np.eye(4), np.eye(4)
    view[:3, :3], view[:3, 3] = camera["R"], camera["t"]
    motion[:3, :3] = rodrigues(turn)
    motion[:3, 3] = root + move - motion[:3, :3] @ root
    result: Array = motion @ np.linalg.inv(view) @ np.diag([1.0, -1, -1, 1])
    return result


def _intrinsics(document: dict[str, Any], camera: dict[str, Any]) -> dict[str, float]:
    k = camera["K"]
    sizes = {"w": document["width"], "h": document["height"]}
    return {"fl_x": k[0][0], "fl_y": k[1][1], "cx": k[0][2], "cy": k[1][2], **sizes}
