"""Body models as files: plain arrays, FLAME's pickle, and the files of a face tracker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from samples.subjects.body_model import PARENTS, BodyModel
from samples.subjects.containers import Chunks, pickled_array, save_pickle, save_torch

Array = npt.NDArray[Any]

SHAPE_COEFFICIENTS, EXPRESSION_COEFFICIENTS = 300, 100
REST_6D = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # the first two rows of the identity


def save_body(body: BodyModel, shape: Array, folder: Path) -> None:
    """body_model.npz, eyelid shapes, anchor faces; shape.npy [300] if the identity shape is not zero."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(
        folder / "body_model.npz",
        v_template=body.v_template,
        faces=body.faces,
        face_part=body.face_part,
        part_names=np.array(body.part_names),
        shapedirs_identity=body.shapedirs_identity,
        shapedirs_expression=body.shapedirs_expression,
        expression_names=np.array(body.expression_names),
        posedirs=body.posedirs,
        J_regressor=body.J_regressor,
        lbs_weights=body.lbs_weights,
        parents=np.array(PARENTS, np.int32),
        l_eyelid=body.l_eyelid.astype(np.float32),
        r_eyelid=body.r_eyelid.astype(np.float32),
        back_of_head_faces=body.back_of_head_faces,
    )
    np.save(folder / "l_eyelid.npy", body.l_eyelid)
    np.save(folder / "r_eyelid.npy", body.r_eyelid)
    (folder / "back_of_head.txt").write_text("".join(f"{i}\n" for i in body.back_of_head_faces))
    if np.any(shape):
        np.save(folder / "shape.npy", padded(shape, SHAPE_COEFFICIENTS))


def padded(values: Array, count: int) -> Array:
    """The values along the last axis as float32, followed by zeros up to `count`."""
    out = np.zeros((*values.shape[:-1], count), np.float32)
    out[..., : values.shape[-1]] = values
    return out


def save_flame_pickle(body: BodyModel, path: Path) -> None:
    """The same body with FLAME's keys: identity in columns 0..299 of shapedirs, expressions in 300..399."""
    identity = padded(body.shapedirs_identity, SHAPE_COEFFICIENTS)
    expression = padded(body.shapedirs_expression, EXPRESSION_COEFFICIENTS)
    tree = np.array([PARENTS, range(len(PARENTS))], np.int32).view(np.uint32)
    arrays = {
        "f": body.faces.astype(np.uint32),
        "v_template": body.v_template,
        "shapedirs": np.concatenate([identity, expression], axis=-1),
        "posedirs": body.posedirs,
        "J_regressor": body.J_regressor,
        "kintree_table": tree,
        "weights": body.lbs_weights,
        "J": body.joints,
    }
    content = {name: Chunks.of(array) for name, array in arrays.items()}
    save_pickle(path, {**content, "bs_style": "lbs", "bs_type": "lrotmin"})


def save_tracked_frame(shape: Array, path: Path) -> None:
    """One frame of the metrical tracker: the subject at rest before a frontal camera."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rest = np.array(REST_6D)
    camera = np.diag([1.0, -1.0, -1.0])  # x right, y down, z forward: it looks at the face
    focal, size = 1200.0, 512
    frame: dict[str, dict[str, Array]] = {
        "flame": {
            "exp": np.zeros((1, EXPRESSION_COEFFICIENTS)),
            "shape": padded(shape[None], SHAPE_COEFFICIENTS),
            "tex": np.zeros((1, 140)),
            "sh": np.zeros((1, 9, 3)),
            "eyes": np.tile(rest, 2)[None],
            "eyelids": np.zeros((1, 2)),
            "jaw": rest[None],
        },
        "camera": {
            "R": camera[:2].reshape(1, 6),
            "t": np.array([[0.0, 0.0, 0.9]]),
            "fl": np.array([[2 * focal / size]]),
            "pp": np.zeros((1, 2)),
        },
        "opencv": {
            "R": camera[None],
            "t": np.array([[0.0, 0.0, 0.9]]),
            "K": np.array([[[focal, 0, size / 2], [0, focal, size / 2], [0, 0, 1]]]),
        },
    }
    content: dict[str, Any] = {
        group: {name: pickled(a.astype(np.float32)) for name, a in arrays.items()}
        for group, arrays in frame.items()
    }
    content |= {
        "img_size": pickled(np.array([size, size], np.int64)),
        "frame_id": path.stem,
        "global_step": 0,
    }
    save_torch(path, content)


def pickled(array: Array) -> Any:
    """An ndarray as protocol 2 pickles it."""
    return pickled_array(Chunks.of(array), as_text=True)
