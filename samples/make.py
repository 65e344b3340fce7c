"""Build sample checkpoints: `python -m samples.make OUT`."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from samples.body_model import PARENTS, BodyModel, build_body_model, driving
from samples.gaussian_blendshapes import build_model, save_dump
from samples.head import load_head


def save_body(body: BodyModel, folder: Path) -> None:
    """body_model.npz, the eyelid shapes and the anchor faces, as Gaussian Blendshapes is given them."""
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


def main() -> None:
    p = argparse.ArgumentParser()
    p.add_argument("out", type=Path)
    p.add_argument("--gaussians", type=int, default=20000)
    a = p.parse_args()
    head = load_head()
    body = build_body_model(head)
    model = build_model(head, body, a.gaussians)
    base = a.out / "gaussian_blendshapes"
    save_dump(model, base / "model")
    save_body(body, base / "body")
    (base / "driving.json").write_text(json.dumps(driving(body, head.expression_names), indent=1) + "\n")


if __name__ == "__main__":
    main()
