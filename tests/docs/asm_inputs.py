"""Inputs of `avatar-train asm`: `python -m tests.docs.asm_inputs OUT` writes a head, its landmarks and keypoints."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import trimesh
from samples.asm.data import load_asm_head

KEYPOINTS = {
    "right_eye_outer": 36,
    "right_eye_inner": 39,
    "left_eye_inner": 42,
    "left_eye_outer": 45,
}  # of iBUG
KEYPOINTS |= {"nose_bottom": 33, "mouth_right": 48, "mouth_left": 54}


def main(out: Path) -> None:
    """head.obj, landmarks.json (68 vertices), keypoints.json (seven points) of the low-poly head."""
    template = load_asm_head("rocketbox").template
    landmarks = [template.landmarks[f"ibug_{k}"] for k in range(68)]
    out.mkdir(parents=True, exist_ok=True)
    mesh = trimesh.Trimesh(template.vertices, template.triangles, process=False)
    mesh.export(out / "head.obj", include_normals=False)
    (out / "landmarks.json").write_text(json.dumps(landmarks), "utf-8")
    points = {name: template.vertices[landmarks[mark]].tolist() for name, mark in KEYPOINTS.items()}
    (out / "keypoints.json").write_text(json.dumps(points), "utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
