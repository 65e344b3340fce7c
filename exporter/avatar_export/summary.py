"""The content of an avatar as plain data, which the command line prints as a table or as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.driving.drive import unreached
from avatar_export.readers import bundle
from avatar_export.readers.table import find, read_with
from avatar_runtime.avatar import Avatar, Embedding, Enhancer, Relight, SparseRows
from avatar_runtime.bundle import MANIFEST, handedness, load, opener, read_manifest
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import sh_bases
from avatar_runtime.packs import is_pack, placed, read_pack
from avatar_runtime.topology import topology_hash

# fmt: off
SIDES = {
    "right": (-1, 0, 0), "left": (1, 0, 0), "above": (0, 1, 0), "below": (0, -1, 0), "front": (0, 0, 1),
    "behind": (0, 0, -1),
}
# fmt: on


def inspect(path: Path, system: str | None = None) -> dict[str, Any]:
    """The summary of a bundle, or of a trained avatar as read without its rig.

    `system` skips detection. Raises AvatarError for a path that does not exist or cannot be read."""
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    if system is None and is_pack(path):
        return _pack(path)
    if system is None and bundle.detect(path):
        avatar = load(path)  # checks the manifest before anything else reads it
        manifest = read_manifest(opener(path))
        files = {entry["path"]: entry["bytes"] for entry in manifest["files"]}
        return {
            "kind": "bundle",
            "version": manifest["asset"]["version"],
            "handedness": handedness(manifest),
            **summary(avatar),
            "reference": _reference(manifest["reference"]),
            "files": files,
        }
    reader = find(path, system)
    avatar, _ = read_with(reader, path, reader.without_rig)
    return {"kind": "source", "note": f"convert it to get {MANIFEST}", **summary(avatar)}


def _pack(path: Path) -> dict[str, Any]:
    pack = read_pack(path)
    document = pack.document
    return {
        "kind": "pack",
        "version": document["asset"]["version"],
        "kernels": document["shaders"],
        "handedness": handedness(document["avatar"]),
        "bytes": path.stat().st_size,
        "levels": [
            _level(level, document if index == 0 else level) for index, level in enumerate(document["levels"])
        ],
        "error": {
            name: document.get("error", {}).get(name)
            for name in ("psnr_mask_db", "pixel_mask", "psnr_db", "position_error")
        },
        "packing": document.get("packing"),
        "framing": document.get("framing"),
        "preview": None if pack.preview is None else f"webp, {len(pack.preview)} bytes",
        "not in a pack": "files for engines, reference, enhancer; the bundle has them",
        **summary(placed(pack.avatar)),
    }


def _level(level: Mapping[str, Any], measured: Mapping[str, Any]) -> dict[str, Any]:
    inside = measured.get("error", {}).get("psnr_mask_db")  # the finest level's stands in the document
    return {"gaussians": level["count"], "psnr_mask_db": inside, "height_px": level.get("height_px")}


@np.errstate(over="ignore")
def summary(avatar: Avatar) -> dict[str, Any]:
    """Counts, names, ranges and rules of an avatar, as JSON data."""
    g, b, rig = avatar.gaussians, avatar.blendshapes, avatar.rig
    return {
        "name": avatar.name,
        "system": avatar.provenance.get("system"),
        "gaussians": g.count,
        "groups": {group.name: f"{group.count} ({group.binding})" for group in avatar.groups},
        "sh_degree": avatar.sh_degree,
        "expressions": list(avatar.expression_names),
        "eyelids": list(avatar.eyelids),
        "rules": {
            **{name: value for name, value in asdict(avatar.rules).items() if value is not None},
            "head_pose_in": avatar.head_pose_in,
        },
        "deltas": {
            name: _filled(getattr(b, name))
            for name in ("geometry", "appearance", "correctives", "late_morphs")
        },
        "rig": None
        if rig is None
        else {
            "vertices": len(rig.vertices),
            "triangles": len(rig.triangles),
            "joints": list(rig.joint_names),
            "corrective_joints": len(rig.corrective_joints),
            "anchor_vertices": len(rig.anchor_vertices),
            "mesh_deltas": {
                name: _filled(getattr(rig, name)) for name in ("morphs", "correctives", "late_morphs")
            },
        },
        "embedding": None if avatar.embedding is None else _embedding(avatar.embedding),
        "clips": {clip.name: f"{clip.frames} frames at {clip.fps:g} a second" for clip in avatar.clips},
        "relight": None if avatar.relight is None else _relight(avatar.relight),
        "enhancer": None if avatar.enhancer is None else _enhancer(avatar.enhancer),
        "training_units_per_metre": avatar.training_per_bundle,
        "ranges": {
            "mean_min": _rounded(g.mean.min(axis=0)),
            "mean_max": _rounded(g.mean.max(axis=0)),
            "scale_mm": _rounded(1e3 * np.exp(np.percentile(g.log_scale, [0, 50, 100]))),
            "opacity": _rounded(
                1 / (1 + np.exp(-np.percentile(g.opacity_logit.astype(np.float64), [0, 50, 100])))
            ),
        },
        "driving": _driving(avatar),
        "background": avatar.raster.background,
        "provenance": dict(avatar.provenance),
    }


def _reference(facts: dict[str, Any] | None) -> dict[str, Any] | None:
    """Who made the reference, and for each case the PSNR of profile engine against trainer."""
    if facts is None:
        return None
    lies = {case["name"]: case["engine_psnr_db"] for case in facts["cases"]}
    shown = {
        name: "equal" if db is None else f"engine against trainer {db:.1f} dB" for name, db in lies.items()
    }
    return {"made_by": facts["made_by"], **shown}


def _embedding(embedding: Embedding) -> dict[str, Any]:
    lift = np.abs(embedding.displacement) if len(embedding.displacement) else np.zeros(1)
    return {
        "vertices": len(embedding.canonical_vertices),
        "triangles": len(embedding.triangles),
        "topology_hash": topology_hash(embedding.triangles, len(embedding.canonical_vertices)),
        "displacement_mm": _rounded(1e3 * np.percentile(lift, [50, 100])),
    }


def _relight(relight: Relight) -> dict[str, Any]:
    """What the light of the capture moved with, and what it gave to surfaces that face six ways."""
    given = {side: sh_bases(np.array(way)) @ relight.ambient for side, way in SIDES.items()}
    return {"capture_light_moves_with": relight.frame, **{side: _rounded(rgb) for side, rgb in given.items()}}


def _enhancer(enhancer: Enhancer) -> dict[str, Any]:
    """Its size and its measured quality."""
    worth = (enhancer.psnr_raw_db, enhancer.psnr_enhanced_db)
    return {
        "optional": "render --enhance",
        "bytes": len(enhancer.onnx),
        "trained_on": f"{enhancer.trained_width}x{enhancer.trained_height}",
        "psnr": "not measured"
        if None in worth
        else f"{worth[0]:.2f} dB without it, {worth[1]:.2f} dB with it",
        "measured_on": enhancer.measured_on,
    }


def _filled(sparse: SparseRows) -> str:
    cells = sparse.rows * sparse.columns
    return f"{sparse.entries} of {cells} ({100 * sparse.entries / cells:.1f} %)" if cells else "none"


def _driving(avatar: Avatar) -> dict[str, Any]:
    if avatar.driving.mode == "none":
        way = "convert it with --driving FILE" if avatar.expressions else "it has no expressions"
        return {"mode": "none", "note": f"ARKit cannot drive this avatar; {way}"}
    return {
        "mode": avatar.driving.mode,
        "head_joint": avatar.driving.head_joint,
        "unreached": unreached(avatar),
    }


def _rounded(values: Any) -> list[float]:
    return [float(f"{v:.4g}") for v in values]
