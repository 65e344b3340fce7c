"""The head that a video is fitted to: ICT-FaceKit's mesh and shapes (MIT), and its body model of FLAME's layout."""

from __future__ import annotations

from avatar_trainer.head.body_files import (
    HEAD_LICENCE,
    HEAD_SOURCE,
    SHAPE_COEFFICIENTS,
    padded,
    save_body,
    write_body,
)
from avatar_trainer.head.body_model import (
    FEATURES,
    GAUSSIAN_SHAPES,
    JAW,
    JAW_SHAPES,
    JOINTS,
    NECK,
    PARENTS,
    ROOT,
    BodyModel,
    build_body_model,
    driving,
    rotvec,
)
from avatar_trainer.head.mesh import Mesh, smoothstep, unit
from avatar_trainer.head.model import (
    EYE_TURN,
    Head,
    closing_lids,
    head_arrays,
    head_of,
    load_head_model,
    neck_height,
    part_of,
    smooth_over_mesh,
)
from avatar_trainer.head.person import head_for
from avatar_trainer.head.tracking_mesh import load_tracking_head, tracking_body

# fmt: off
__all__ = [
    "EYE_TURN", "FEATURES", "GAUSSIAN_SHAPES", "HEAD_LICENCE", "HEAD_SOURCE", "JAW", "JAW_SHAPES", "JOINTS", "NECK",
    "PARENTS", "ROOT", "SHAPE_COEFFICIENTS", "BodyModel", "Head", "Mesh", "build_body_model", "closing_lids",
    "driving", "head_arrays", "head_for", "head_of", "load_head_model", "load_tracking_head", "neck_height", "padded",
    "part_of", "rotvec", "save_body", "smooth_over_mesh", "smoothstep", "tracking_body", "unit", "write_body",
]
# fmt: on
