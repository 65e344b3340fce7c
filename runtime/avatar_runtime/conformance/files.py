"""Reference vectors as files, both directions: cases.json, vectors.safetensors and images."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from avatar_runtime.bundle import Open, read_json
from avatar_runtime.camera import Camera
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import png
from avatar_runtime.conformance.checks import CASES, VECTORS, check_reference
from avatar_runtime.conformance.model import (
    Case,
    CaseVectors,
    Expected,
    Reference,
    Step,
    Tensor,
    View,
)
from avatar_runtime.io.errors import AvatarError
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
        "rows": _tensor(ROWS, tensors),
        "vertices": _tensor(VERTICES, tensors),
        "cases": [_case(vectors, tensors) for vectors in reference.cases],
    }
    files = {
        CASES: _text(document).encode(),
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

    def tensor(said: Mapping[str, Any]) -> str:
        name = str(said["tensor"])
        if name not in held:
            raise AvatarError("is missing", file=VECTORS, field=name)
        a, dtype, shape = held[name], said["dtype"], tuple(map(int, said["shape"]))
        if a.dtype.name != dtype or a.shape != shape:
            want, found = f"{dtype}{list(shape)}", f"{a.dtype.name}{list(a.shape)}"
            raise AvatarError(f"is {found}, {CASES} says {want}", file=VECTORS, field=name)
        return name

    cases = []
    for said in document["cases"]:
        case = _decode_case(said)
        steps = tuple(_decode_step(stage, tensor) for stage in said["stages"])
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


def step_tensors(step: Step) -> list[str]:
    """The tensors of a step."""
    of_outputs = [t for e in step.outputs.values() for t in (e.tensor, e.weight) if t is not None]
    return [*step.inputs.values(), *of_outputs, *([] if step.pixels is None else [step.pixels])]


def _text(document: dict[str, Any]) -> str:
    """JSON that people can read: indented, with a list of numbers on one line."""
    text = json.dumps(document, indent=1, ensure_ascii=False)
    return re.sub(r"\[\n[^\[\]{}]*\]", lambda found: " ".join(found[0].split()), text) + "\n"


def _image_names(case: str, profile: str) -> tuple[str, str]:
    return f"{case}.{profile}.png", f"{case}.{profile}.alpha.png"


def _tensor(name: str, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    return {"tensor": name, "dtype": tensors[name].dtype.name, "shape": list(tensors[name].shape)}


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
        "stages": [_step(step, tensors) for step in vectors.steps],
        "pictures": [
            {"profile": p, "colour": colour, "alpha": alpha} for p, (colour, alpha) in named.items()
        ],
    }
    return said | ({"engine_psnr_db": vectors.engine_psnr_db} if vectors.images else {})


def _step(step: Step, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    said: dict[str, Any] = {"stage": step.stage}
    if step.profile is not None:
        said["profile"] = step.profile
    said["inputs"] = {array: _tensor(name, tensors) for array, name in step.inputs.items()}
    said["outputs"] = {array: _output(expected, tensors) for array, expected in step.outputs.items()}
    if step.pixels is not None:
        said["pixels"] = _tensor(step.pixels, tensors)
    return said


def _output(expected: Expected, tensors: Mapping[str, Tensor]) -> dict[str, Any]:
    said = _tensor(expected.tensor, tensors) | {"atol": expected.atol, "rtol": expected.rtol}
    if expected.weight is not None:
        said["weight"] = _tensor(expected.weight, tensors)
    if expected.flips is not None:
        said |= {"flips": expected.flips, "most_flips": expected.most_flips}
    return said


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
        )


def _decode_step(said: Mapping[str, Any], tensor: Any) -> Step:
    return Step(
        said["stage"],
        said.get("profile"),
        {array: tensor(entry) for array, entry in said["inputs"].items()},
        {
            array: Expected(
                tensor(entry),
                float(entry["atol"]),
                float(entry["rtol"]),
                tensor(entry["weight"]) if "weight" in entry else None,
                entry.get("flips"),
                int(entry.get("most_flips", 0)),
            )
            for array, entry in said["outputs"].items()
        },
        tensor(said["pixels"]) if "pixels" in said else None,
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
