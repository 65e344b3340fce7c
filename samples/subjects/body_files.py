"""Body models as files: FLAME's pickle, and the files of a face tracker."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import PARENTS, SHAPE_COEFFICIENTS, BodyModel, padded
from samples.subjects.containers import Chunks, pickled_array, save_pickle, save_torch

Array = npt.NDArray[Any]

EXPRESSION_COEFFICIENTS = 100
REST_6D = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # the first two rows of the identity


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
