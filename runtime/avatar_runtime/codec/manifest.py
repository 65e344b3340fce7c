"""avatar.json, encode and decode: everything of an Avatar that is not an array."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

import numpy as np

from avatar_runtime.avatar import (
    F32,
    Avatar,
    Driving,
    Embedding,
    Enhancer,
    Expression,
    Group,
    RasterSettings,
    Relight,
    Rules,
)
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.topology import topology_hash
from avatar_schema import LATEST, schema

FRAME = {"up": "+Y", "face": "+Z", "length_unit": "metre", "quaternion_order": "wxyz"}
RASTER = {"profile": "trainer", "antialiased": False, "low_pass": 0.0, "near": 0.0, "depth_key": "view_z"}
BLENDSHAPES = ("geometry", "appearance", "correctives", "late_morphs")
ENHANCER_FILE = "enhancer.onnx"


def encode(
    avatar: Avatar,
    files: list[dict[str, Any]],
    bounds: Mapping[str, Any],
    generator: str,
    engine: Mapping[str, Any] | None = None,
    reference: Mapping[str, Any] | None = None,
    handedness: str = "right",
) -> dict[str, Any]:
    """The manifest of a bundle that holds `files` ({path, bytes, sha256, derived}) and `avatar` as it is.

    `engine`: how the files for engines were made and what they cannot represent; None: there are none.
    `reference`: who made reference/, and of which cases; None if there is no reference.
    `handedness` is that of the frame in which `avatar` and `bounds` are.
    """
    background = avatar.raster.background
    known: dict[str, Any] = {
        "format": "avatar-export",
        "asset": {"version": LATEST, "minVersion": LATEST, "generator": generator},
        "extensionsUsed": [],
        "extensionsRequired": [],
        "name": avatar.name,
        "frame": {"handedness": handedness} | FRAME,
        "units": {"training_per_bundle": avatar.training_per_bundle},
        "gaussians": {
            "count": avatar.gaussians.count,
            "sh_degree": avatar.sh_degree,
            "sh_degree_stored": avatar.gaussians.sh_degree,
        },
        "groups": [_group(group) for group in avatar.groups],
        "rules": asdict(avatar.rules) | {"normal": "unit", "late_morphs": "after_skin"},
        "expressions": [
            {"name": e.name, "aliases": list(e.aliases), "range": list(e.range)} for e in avatar.expressions
        ],
        "late_morphs": list(avatar.eyelids),
        "joints": None if avatar.rig is None else list(avatar.rig.joint_names),
        "clips": [{"name": c.name, "fps": c.fps, "frames": c.frames} for c in avatar.clips],
        "embedding": None if avatar.embedding is None else _embedding(avatar.embedding),
        "head_pose_in": avatar.head_pose_in,
        "driving": _driving(avatar.driving),
        "raster": RASTER | {"low_pass": avatar.raster.low_pass, "near": avatar.raster.near},
        "color_space": "srgb_rec709_display",
        "background": background if isinstance(background, str) else list(background),
        "blendshapes": {
            "entries": {name: getattr(avatar.blendshapes, name).entries for name in BLENDSHAPES},
            "threshold": dict(avatar.delta_threshold),
        },
        "bounds": dict(bounds),
        "engine": None if engine is None else dict(engine),
        "reference": None if reference is None else dict(reference),
        "files": files,
        "provenance": dict(avatar.provenance),
    }
    if avatar.relight is not None:
        known["relight"] = encode_relight(avatar.relight)
    if avatar.enhancer is not None:
        known["enhancer"] = encode_enhancer(avatar.enhancer)
    return known | dict(avatar.extras)


def encode_relight(relight: Relight) -> dict[str, Any]:
    """What a manifest says of it; the normals are an array."""
    return {
        "frame": relight.frame,
        "joint": relight.joint,
        "ambient": [[float(v) for v in row] for row in relight.ambient],
        "centre": list(relight.centre),
        "radius": relight.radius,
    }


def decode_relight(said: Mapping[str, Any], normal: F32) -> Relight:
    """Of key `relight` of a manifest that the schema accepts, and the normals [N, 3]."""
    x, y, z = map(float, said["centre"])
    ambient = np.array(said["ambient"], np.float64).astype(np.float32)
    return Relight(normal, ambient, said["frame"], (x, y, z), float(said["radius"]), said.get("joint"))


def unknown_keys(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """Top-level keys that this version does not define, `extras` and `extensionsUsed`: kept through load and save."""
    defined = set(schema("avatar")["properties"]) - {"extras", "extensionsUsed"}
    kept = {key: value for key, value in manifest.items() if key not in defined}
    if not kept.get("extensionsUsed"):
        kept.pop("extensionsUsed", None)
    return kept


def decode_facts(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of an Avatar that a manifest, which the schema accepts, states without arrays; `groups` apart."""
    return {
        "name": manifest["name"],
        "rules": decode_rules(manifest),
        "expressions": decode_expressions(manifest),
        "eyelids": tuple(manifest["late_morphs"]),
        "sh_degree": int(manifest["gaussians"]["sh_degree"]),  # JSON knows 2.0 as an integer
        "driving": decode_driving(manifest),
        "raster": decode_raster(manifest),
        "head_pose_in": manifest["head_pose_in"],
        "training_per_bundle": float(manifest["units"]["training_per_bundle"]),
        "delta_threshold": _floats(manifest["blendshapes"]["threshold"]),
        "provenance": manifest["provenance"],
        "extras": unknown_keys(manifest),
    }


def decode_groups(manifest: Mapping[str, Any]) -> tuple[Group, ...]:
    """Groups of a manifest that the schema accepts, in draw order."""
    return tuple(
        Group(g["name"], int(g["first"]), int(g["count"]), g["binding"], _floats(g.get("joint_mix", {})))
        for g in manifest["groups"]
    )


def _floats(named: Mapping[str, Any]) -> dict[str, float]:
    """Numbers by name: JSON may write 1.0 as 1."""
    return {name: float(number) for name, number in named.items()}


def decode_rules(manifest: Mapping[str, Any]) -> Rules:
    """Rules of a manifest that the schema accepts."""
    rules = manifest["rules"]
    return Rules(**{field.name: rules[field.name] for field in fields(Rules) if field.name in rules})


def decode_expressions(manifest: Mapping[str, Any]) -> tuple[Expression, ...]:
    """Expressions, in column order."""
    return tuple(
        Expression(e["name"], tuple(e.get("aliases", ())), (float(e["range"][0]), float(e["range"][1])))
        for e in manifest["expressions"]
    )


def decode_driving(manifest: Mapping[str, Any]) -> Driving:
    """Driving; raises AvatarError for a matrix that is not rows of numbers."""
    d = manifest["driving"]
    matrix = d.get("matrix")
    shape = (len(d.get("outputs", ())), len(d.get("inputs", ())))
    pivot = d.get("head_pivot", (0.0, 0.0, 0.0))
    return Driving(
        d["mode"],
        tuple(d.get("inputs", ())),
        tuple(d.get("outputs", ())),
        None if matrix is None else _matrix(matrix, shape),
        d.get("head_joint"),
        (float(pivot[0]), float(pivot[1]), float(pivot[2])),
        d.get("left_eye_joint"),
        d.get("right_eye_joint"),
    )


def decode_raster(manifest: Mapping[str, Any]) -> RasterSettings:
    """What the trainer's renderer used."""
    background = manifest["background"]
    if not isinstance(background, str):
        r, g, b = map(float, background)
        background = (r, g, b)
    return RasterSettings(
        float(manifest["raster"]["near"]), float(manifest["raster"]["low_pass"]), background
    )


def decode_enhancer(said: Mapping[str, Any], onnx: bytes) -> Enhancer:
    """The enhancer that entry `said` of a manifest describes; `onnx` is its file, which is not parsed."""
    decibels = {
        name: None if said[name] is None else float(said[name])
        for name in ("psnr_raw_db", "psnr_enhanced_db")
    }
    return Enhancer(
        onnx=onnx,
        input=said["input"],
        output=said["output"],
        trained_width=int(said["trained_width"]),
        trained_height=int(said["trained_height"]),
        measured_on=said["measured_on"],
        **decibels,
    )


def encode_enhancer(enhancer: Enhancer) -> dict[str, Any]:
    """What a manifest says of an enhancer."""
    return {
        "file": ENHANCER_FILE,
        "input": enhancer.input,
        "output": enhancer.output,
        "layout": "NCHW",
        "trained_width": enhancer.trained_width,
        "trained_height": enhancer.trained_height,
        "psnr_raw_db": enhancer.psnr_raw_db,
        "psnr_enhanced_db": enhancer.psnr_enhanced_db,
        "measured_on": enhancer.measured_on,
        "optional": True,
    }


def _group(group: Group) -> dict[str, Any]:
    entry = {"name": group.name, "first": group.first, "count": group.count, "binding": group.binding}
    return entry | ({"joint_mix": dict(group.joint_mix)} if group.joint_mix else {})


def _embedding(embedding: Embedding) -> dict[str, Any]:
    vertices = len(embedding.canonical_vertices)
    return {
        "vertices": vertices,
        "triangles": len(embedding.triangles),
        "topology_hash": topology_hash(embedding.triangles, vertices),
    }


def _driving(d: Driving) -> dict[str, Any]:
    return {
        "mode": d.mode,
        "inputs": list(d.inputs),
        "outputs": list(d.outputs),
        "matrix": None if d.matrix is None else [[float(v) for v in row] for row in d.matrix],
        "head_joint": d.head_joint,
        "head_pivot": list(d.head_pivot),
        "left_eye_joint": d.left_eye_joint,
        "right_eye_joint": d.right_eye_joint,
        "rotation_unit": "radian",
    }


def _matrix(rows: list[Any], shape: tuple[int, int]) -> F32:
    """[O, I]; checked here, since a schema takes 50 ms for it and `all` takes 1 ms."""
    for index, row in enumerate(rows):
        if not (isinstance(row, list) and len(row) == shape[1] and all(type(v) in (int, float) for v in row)):
            where = f"$.driving.matrix[{index}]"
            raise AvatarError(
                f"must be a list of {shape[1]} numbers, one an input", file="avatar.json", field=where
            )
    with np.errstate(over="ignore"):  # a value beyond float32 becomes infinite, and check_avatar refuses it
        return np.array(rows, np.float32).reshape(len(rows), shape[1])
