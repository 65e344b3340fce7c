"""Cases of `driving` and `joints` as files, both directions: driving.json and driving.safetensors."""

from __future__ import annotations

from avatar_runtime.bundle import Open, read_json
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance.driving_checks import DRIVING_CASES, DRIVING_VECTORS, check_driving
from avatar_runtime.conformance.model import DrivingCase, DrivingReference
from avatar_runtime.conformance.steps import decode_step, json_text, step_entry, tensor_finder
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError
from avatar_schema import LATEST
from avatar_schema.validate import document_problems

CASES_LIMIT, VECTORS_LIMIT = 4 << 20, 64 << 20  # bytes; ours are hundredths of that


def encode_driving(reference: DrivingReference) -> dict[str, bytes]:
    """Both files by name; the same reference gives the same bytes."""
    document = {
        "format": "avatar-export-driving",
        "asset": {"version": LATEST, "minVersion": LATEST, "generator": reference.generator},
        "avatar": reference.avatar,
        "handedness": reference.handedness,
        "channels": list(CHANNELS),
        "cases": [
            {
                "name": case.name,
                "why": case.why,
                "within_range": case.within_range,
                "stages": [step_entry(step, reference.tensors) for step in case.steps],
            }
            for case in reference.cases
        ],
    }
    return {
        DRIVING_CASES: json_text(document).encode(),
        DRIVING_VECTORS: b"".join(safetensors.encode(reference.tensors)),
    }


def decode_driving(read: Open) -> DrivingReference:
    """The reference whose files `read(name, most bytes)` gives.

    Raises AvatarError for a newer version, a missing or misshapen tensor, a number that is not finite: one line that
    names the file and what in it.
    """
    document = read_json(read, DRIVING_CASES, CASES_LIMIT)
    errors = [p for p in document_problems(document, "driving") if not p.warning]
    if errors:
        raise AvatarError(errors[0].message, file=DRIVING_CASES, field=errors[0].path)
    if document["channels"] != list(CHANNELS):
        raise AvatarError("are not the 61 channels in their order", file=DRIVING_CASES, field="channels")
    held = safetensors.decode(read(DRIVING_VECTORS, VECTORS_LIMIT), DRIVING_VECTORS)
    tensor = tensor_finder(held, DRIVING_CASES, DRIVING_VECTORS)
    cases = tuple(
        DrivingCase(
            said["name"],
            said["why"],
            said["within_range"],
            tuple(decode_step(step, tensor) for step in said["stages"]),
        )
        for said in document["cases"]
    )
    reference = DrivingReference(
        document["asset"]["generator"], document["avatar"], document["handedness"], held, cases
    )
    check_driving(reference)
    return reference
