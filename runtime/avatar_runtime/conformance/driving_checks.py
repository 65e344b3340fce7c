"""Checks cases of `driving` and `joints`: names and shapes as in the tables, finite numbers, small tolerances."""

from __future__ import annotations

from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance.arrays import DRIVING, JUDGED, WHEN, inputs_of, sizes
from avatar_runtime.conformance.checks import check_arrays, check_tolerance, named_arrays
from avatar_runtime.conformance.model import DrivingReference
from avatar_runtime.io.errors import AvatarError

DRIVING_CASES, DRIVING_VECTORS = "driving.json", "driving.safetensors"
STEPS = (DRIVING, "joints")


def check_driving(reference: DrivingReference) -> None:
    """Raise AvatarError for faults that do not depend on the avatar."""
    _check(reference, {})


def check_driving_fits(reference: DrivingReference, avatar: Avatar) -> None:
    """Raise AvatarError where `reference` is not one of `avatar`."""
    _check(reference, sizes(avatar))
    for case in reference.cases:
        for step in case.steps:
            field = f"{case.name}/{step.stage}"
            if not WHEN[JUDGED[step.stage].when](avatar, None):
                raise AvatarError(
                    "is a stage that this avatar does not have", file=DRIVING_CASES, field=field
                )
            missing = set() if step.stage == DRIVING else {a.name for a in inputs_of(step.stage, avatar)}
            missing -= step.inputs.keys()
            if missing:
                raise AvatarError(f"lacks {', '.join(sorted(missing))}", file=DRIVING_CASES, field=field)


def _check(reference: DrivingReference, known: dict[str, int]) -> None:
    """`known` are lengths by symbol; what it lacks is learned from the first array that has it."""
    names = [case.name for case in reference.cases]
    for case in reference.cases:
        if names.count(case.name) > 1:
            raise AvatarError("is the name of two cases", file=DRIVING_CASES, field=case.name)
        found = [step.stage for step in case.steps]
        if found != [stage for stage in STEPS if stage in found]:
            raise AvatarError("has its stages twice or out of order", file=DRIVING_CASES, field=case.name)
        for step in case.steps:
            table, field = JUDGED[step.stage], f"{case.name}/{step.stage}"
            outputs = {array: expected.tensor for array, expected in step.outputs.items()}
            for rows, given in ((table.inputs, step.inputs), (table.outputs, outputs)):
                named = named_arrays(rows, given, field, DRIVING_CASES)
                check_arrays(reference.tensors, named, known, DRIVING_VECTORS)
            for array in table.outputs:
                expected = step.outputs[array.name]
                check_tolerance(array, expected, reference.tensors, float(array.floor), field, DRIVING_CASES)
