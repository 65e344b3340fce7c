"""Reference vectors as files, both directions: cases.json, vectors.safetensors and images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from avatar_runtime.bundle import Open, read_json
from avatar_runtime.camera import Camera
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import png
from avatar_runtime.conformance.checks import CASES, VECTORS, check_reference
from avatar_runtime.conformance.model import Case, CaseVectors, Reference, Tensor, View
from avatar_runtime.conformance.steps import (
    decode_step,
    json_text,
    step_entry,
    step_tensors,
    tensor_entry,
    tensor_finder,
)
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import light_of, said_light
from avatar_runtime.pose import Pose
from avatar_schema import LATEST
from avatar_schema.validate import document_problems

ROWS, VERTICES = "rows", "vertices"  # tensors
CASES_LIMIT, VECTORS_LIMIT, IMAGE_LIMIT = 4 << 20, 64 << 20, 4 << 20  # bytes; ours are tenths of that


def encode(reference: Reference) -> dict[str, bytes]:
    """Every file by name; the same reference gives the same bytes. Tensors that no stage uses are left out."""
    tensors: dict[str, Tensor] = {ROWS: reference.rows, VERTICES: reference.vertices}
    names = {t for vectors in reference.cases for step in vectors.steps for t in step_tensors(step)}
    tensors |= {name: reference.tensors[name] for name in sorted(names)}
    document = {
        "format": "avatar-export-reference",
        "asset": {"version": LATEST, "minVersion": LATEST, "generator": reference.generator},
        "made_by": reference.made_by,
        "avatar": reference.avatar,
        "files": dict(reference.files),
        "rows": tensor_entry(ROWS, tensors),
        "vertices": tensor_entry(VERTICES, tensors),
        "cases": [_case(vectors, tensors) for vectors in reference.cases],
    }
    files = {
        CASES: json_text(document).encode(),
        VECTORS: b"".join(safetensors.encode(tensors)),
    }
    for vectors in reference.cases:
        for profile, view in vectors.images.items():
            colour, alpha = _image_names(vectors.case.name, profile)
            files |= {colour: png.encode(view.colour), alpha: png.encode(view.alpha)}
    return files


def decode(read: Open) -> Reference:
    """The reference whose files `read(name, most bytes)` gives.

    Raises AvatarError for a newer version, a missing or misshapen tensor, a number that is not finite, a damaged
    image: one line that names the file and what in it.
    """
    document = read_json(read, CASES, CASES_LIMIT)
    errors = [p for p in document_problems(document, "reference") if not p.warning]
    if errors:
        raise AvatarError(errors[0].message, file=CASES, field=errors[0].path)
    held = safetensors.decode(read(VECTORS, VECTORS_LIMIT), VECTORS)

    tensor = tensor_finder(held, CASES, VECTORS)
    cases = []
    for said in document["cases"]:
        case = _decode_case(said)
        steps = tuple(decode_step(stage, tensor) for stage in said["stages"])
        images = {entry["profile"]: _decode_view(entry, case.camera, read) for entry in said["pictures"]}
        cases.append(CaseVectors(case, steps, images, said.get("engine_psnr_db")))
    reference = Reference(
        document["made_by"],
        document["asset"]["generator"],
        document["avatar"],
        held[tensor(document["rows"])],
        held[tensor(document["vertices"])],
        held,
        tuple(cases),
        document.get("files", {}),
    )
    check_reference(reference)
    return reference


def _image_names(case: str, profile: str) -> tuple[str, str]:
    return f"{case}.{profile}.png", f"{case}.{profile}.alpha.png"


def _case(vectors: CaseVectors, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    case, camera, pose = vectors.case, vectors.case.camera, vectors.case.pose
    named = {profile: _image_names(case.name, profile) for profile in vectors.images}
    said = {
        "name": case.name,
        "why": case.why,
        "pose": {
            "expressions": {name: float(weight) for name, weight in pose.expressions.items()},
            "joints": {name: _floats(matrix) for name, matrix in pose.joints.items()},
            "eyelids": {name: float(weight) for name, weight in pose.eyelids.items()},
            "world_from_avatar": _floats(pose.world_from_avatar),
        },
        "camera": {
            "camera_from_world": _floats(camera.camera_from_world),
            "clip_from_world": _floats(camera.clip_from_world),
            "centre": _floats(camera.centre),
            "tan_half_fov_x": camera.tan_half_fov_x,
            "tan_half_fov_y": camera.tan_half_fov_y,
            "width": camera.width,
            "height": camera.height,
        },
        "background": list(case.background),
        **({} if case.light is None else {"light": said_light(case.light)}),
        "stages": [step_entry(step, tensors) for step in vectors.steps],
        "pictures": [
            {"profile": p, "colour": colour, "alpha": alpha} for p, (colour, alpha) in named.items()
        ],
    }
    return said | ({"engine_psnr_db": vectors.engine_psnr_db} if vectors.images else {})


def _floats(values: Any) -> list[float]:
    """Row by row; a float32 survives as the double that it is."""
    return [float(v) for v in np.asarray(values).reshape(-1)]


def _decode_case(said: Mapping[str, Any]) -> Case:
    pose, camera = said["pose"], said["camera"]
    red, green, blue = map(float, said["background"])
    with np.errstate(over="ignore"):  # beyond float32 becomes infinite, which the checks refuse
        return Case(
            said["name"],
            said["why"],
            Pose(
                pose["expressions"],
                {joint: _matrix(numbers) for joint, numbers in pose["joints"].items()},
                pose["eyelids"],
                _matrix(pose["world_from_avatar"]),
            ),
            Camera(
                _matrix(camera["camera_from_world"]).astype(np.float32),
                _matrix(camera["clip_from_world"]).astype(np.float32),
                np.array(camera["centre"], np.float32),
                float(camera["tan_half_fov_x"]),
                float(camera["tan_half_fov_y"]),
                int(camera["width"]),
                int(camera["height"]),
            ),
            (red, green, blue),
            bool(said["pictures"]),
            light_of(said["light"], CASES) if "light" in said else None,
        )


def _decode_view(said: Mapping[str, Any], camera: Camera, read: Open) -> View:
    """Images are named by the document, so a name may not lead out of the folder."""
    for name in (said["colour"], said["alpha"]):
        if "/" in name or "\\" in name or not name.endswith(".png"):
            raise AvatarError(
                f"{name[:80]!r} is not the name of an image in the same folder", file=CASES, field="pictures"
            )
    size = (camera.height, camera.width)
    colour = png.decode(read(said["colour"], IMAGE_LIMIT), (*size, 3), said["colour"])
    return View(colour, png.decode(read(said["alpha"], IMAGE_LIMIT), size, said["alpha"]))


def _matrix(numbers: Any) -> Tensor:
    return np.array(numbers, np.float64).reshape(4, 4)
