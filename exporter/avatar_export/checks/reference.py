"""reference/ of a bundle: read, checked against the files that it was made for, and played on backend `reference`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from avatar_export.writers.reference import FOLDER, REFERENCE_FILES, reference_facts
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import MANIFEST, Data, Open, checked_bytes
from avatar_runtime.codec.manifest import ENHANCER_FILE
from avatar_runtime.conformance import Reference, Row, conform, decode
from avatar_runtime.io.errors import AvatarError
from avatar_schema.validate import Problem

CASES_FILE = REFERENCE_FILES[0]


def read_reference(document: Mapping[str, Any], read: Open) -> Reference:
    """The reference of the bundle whose manifest is `document`.

    Raises AvatarError without one, if a file of it is missing, altered or unsound, or if it was made for other
    normative files than those of the bundle.
    """
    listed = {entry["path"]: entry for entry in document["files"]}
    if CASES_FILE not in listed:
        message = "is missing, so there is nothing to compare with; `convert` writes it"
        raise AvatarError(message, file=FOLDER.rstrip("/"))

    def checked(name: str, most: int) -> Data:
        entry = listed.get(FOLDER + name)
        if entry is None:
            raise AvatarError(f"does not list {FOLDER}{name}", file=MANIFEST, field="$.files")
        if entry["bytes"] > most:
            raise AvatarError(f"is {entry['bytes']} bytes, expected at most {most}", file=FOLDER + name)
        return checked_bytes(read, entry)

    with named_in_full():
        reference = decode(checked)
    normative = {
        path: entry["sha256"]
        for path, entry in listed.items()
        if not entry["derived"] and path != ENHANCER_FILE  # the reference does not use it
    }
    changed = sorted(
        path for path in {*normative, *reference.files} if normative.get(path) != reference.files.get(path)
    )
    if changed:
        message = f"was made for another {' and '.join(changed)}; run `convert` again"
        raise AvatarError(message, file=CASES_FILE)
    return reference


@contextmanager
def named_in_full() -> Iterator[None]:
    """Errors inside name the files of the reference by their path in the bundle."""
    try:
        yield
    except AvatarError as error:
        if error.file is None or FOLDER + error.file not in REFERENCE_FILES:
            raise
        raise AvatarError(error.message, file=FOLDER + error.file, field=error.field) from None


def reference_problems(stored: Avatar, document: Mapping[str, Any], read: Open) -> Iterator[Problem]:
    """Problems of the reference, if there is one: each stage that backend `reference` does not repeat.

    `stored` is the avatar in the frame of the bundle's files. Values are compared within tolerances, since NumPy rounds
    differently on different machines.
    """
    said = document["reference"]
    if not said and not any(entry["path"] == CASES_FILE for entry in document["files"]):
        return
    try:
        reference = read_reference(document, read)
        with named_in_full():
            report = conform(stored, reference, "reference")
    except AvatarError as error:
        where = ": ".join(part for part in (error.file, error.field) if part) or CASES_FILE
        yield Problem(where, error.message)
        return
    if said != reference_facts(reference):
        yield Problem(f"{MANIFEST}: $.reference", f"differs from {CASES_FILE}")
    for row in report.rows:
        if not row.passed:
            yield Problem(f"{FOLDER}vectors.safetensors: {row.stage}", _off(row))
    for image in report.images:
        if not image.passed:
            off = f"differs by up to {image.difference:.1f} of 255, allowed {image.tolerance:g}"
            yield Problem(f"{FOLDER}{image.case}.{image.profile}.png", off)


def _off(row: Row) -> str:
    found = row.verdict
    times = f"{found.used:.3g} times the tolerance, {found.flips} flips"
    return f"{row.array} of case {row.case} {found.note or f'differs by {found.error:.3g}, {times}'}"
