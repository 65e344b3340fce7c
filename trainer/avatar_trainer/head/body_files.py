"""A body model as plain arrays, in the files that captures hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from avatar_trainer.head.body_model import PARENTS, BodyModel, build_body_model
from avatar_trainer.head.mesh import Array
from avatar_trainer.head.model import Head
from avatar_trainer.head.tracking_mesh import tracking_body

SHAPE_COEFFICIENTS = 300  # of FLAME
# What goes into capture.json, and so into the manifest of an avatar that is trained on this head. A body model file
# holds the licence, too; then the exporter does not ask for the terms of a body model.
HEAD_LICENCE = "head mesh: ICT-FaceKit, Copyright (c) 2020 USC Institute for Creative Technologies: MIT"
HEAD_SOURCE = "head mesh of ICT-FaceKit (MIT), fitted to a video; no other body model, and none of its terms"


def write_body(head: Head, folder: Path) -> BodyModel:
    """The files of the tracking body of `head`, which is one person's: no identity shape goes with it; returns it."""
    body = tracking_body(head, build_body_model(head))
    save_body(body, np.zeros(0), folder, licence=HEAD_LICENCE)
    return body


def save_body(body: BodyModel, shape: Array, folder: Path, *, licence: str = "") -> None:
    """body_model.npz, eyelid shapes, anchor faces; shape.npy [300] if the identity shape is not zero."""
    folder.mkdir(parents=True, exist_ok=True)
    terms: dict[str, Any] = {"licence": np.array([licence])} if licence else {}
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
        **terms,
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
