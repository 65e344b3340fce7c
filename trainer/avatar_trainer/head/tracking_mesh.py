"""A coarser head for tracking, like FLAME: its 6,000 vertices are vertices of the full head.

data/tracking_mesh.npz says which, and their triangles: edges collapsed into one of their ends by quadric errors
(Garland and Heckbert 1997), summed over the scanned face of the samples at rest and in six expressions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_trainer.head.body_model import BodyModel, back_of_head, regressor
from avatar_trainer.head.mesh import Array
from avatar_trainer.head.model import DATA, Head, part_of

PATH = DATA / "tracking_mesh.npz"


def load_tracking_head(head: Head) -> tuple[Head, Array]:
    """(the coarse copy of `head`, the rows [v] of its vertices in `head`)."""
    with np.load(PATH, allow_pickle=False) as file:
        rows, triangles, part = (file[name].astype(np.int64) for name in ("rows", "triangles", "part"))
    return part_of(head, rows, triangles, part), rows


def tracking_body(head: Head, body: BodyModel) -> BodyModel:
    """The body model of the coarse head: rows of `body`, with the same joints."""
    coarse, rows = load_tracking_head(head)
    shapes = body.shapedirs_expression[rows]
    return replace(
        body,
        v_template=body.v_template[rows],
        faces=coarse.triangles.astype(np.int32),
        face_part=coarse.part.astype(np.uint8),
        shapedirs_identity=body.shapedirs_identity[rows],
        shapedirs_expression=shapes,
        posedirs=body.posedirs[rows],
        J_regressor=regressor(coarse, body.joints, shapes, False).astype(np.float32),
        lbs_weights=body.lbs_weights[rows],
        l_eyelid=body.l_eyelid[rows],
        r_eyelid=body.r_eyelid[rows],
        back_of_head_faces=back_of_head(coarse),
    )
