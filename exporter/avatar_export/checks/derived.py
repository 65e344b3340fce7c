"""Compares the derived files of a bundle with what its normative files give."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from avatar_export.writers.table import INFLUENCES, WRITERS, Export, Writer, engine_facts
from avatar_runtime.avatar import F32, F64, Avatar, Gaussians
from avatar_runtime.bundle import MANIFEST, Open, checked_bytes, handedness
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.surface import binding_pose
from avatar_schema.validate import Problem

BINDING_TOLERANCE = 1e-5  # between gaussians.ply and the embedding: metres, and distance of unit quaternions
FIGURE_TOLERANCE = 1e-3  # millimetres, of the errors of engine files in the manifest


def derived_problems(avatar: Avatar, document: Mapping[str, Any], read: Open) -> Iterator[Problem]:
    """Makes every listed derived file with valid size and hash again and yields the differences.

    Files that differ only in bytes (another library version) pass if their contents are equal up to the rounding of
    float32. The Gaussians of a surface avatar are compared too, since the embedding gives their xyz and rot.
    """
    yield from _binding_pose(avatar)
    engine = document["engine"]
    influences = engine["influences"] if engine else INFLUENCES[0]
    export = Export(avatar, influences, handedness(document))
    if engine:
        try:
            yield from _figures(engine, engine_facts(export))
        except AvatarError as error:
            yield Problem(f"{MANIFEST}: $.engine", str(error))
    writers = {writer.path: writer for writer in WRITERS}
    for entry in document["files"]:
        name, writer = entry["path"], writers.get(entry["path"])
        if writer is None:
            yield Problem(name, "is not a file of this version; it is not checked", warning=True)
        elif writer.derived != entry["derived"]:
            want = "derived" if writer.derived else "not derived"
            yield Problem(f"{MANIFEST}: $.files", f"{name} is {want}, but the manifest says otherwise")
        elif writer.derived and writer.part != "reference":  # the reference is played, not made again
            yield from _compared(writer, export, entry, read)


def _compared(writer: Writer, export: Export, entry: Mapping[str, Any], read: Open) -> Iterator[Problem]:
    try:
        stored = bytes(checked_bytes(read, dict(entry)))
    except AvatarError:
        return  # already reported
    try:
        pieces = writer.pieces(export)
        if pieces is None:
            yield Problem(writer.path, "is not a file of such an avatar")
            return
        difference = writer.same(stored, b"".join(pieces))
        for message in writer.problems(export):
            yield Problem(writer.path, message)
    except AvatarError as error:
        yield Problem(writer.path, error.message)
        return
    if difference is not None:
        yield Problem(
            writer.path, f"does not match the other files: {difference}; run `convert` again to write it anew"
        )


def _figures(said: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[Problem]:
    for name, value in found.items():
        stated = said.get(name)
        if isinstance(stated, int | float) and abs(stated - value) <= FIGURE_TOLERANCE + 1e-3 * abs(value):
            continue
        yield Problem(f"{MANIFEST}: $.engine.{name}", f"is {stated}, but measures {value:.6g}")


def _binding_pose(avatar: Avatar) -> Iterator[Problem]:
    if avatar.embedding is None:
        return
    # Values that are too large to compare are a problem below.
    with np.errstate(over="ignore", invalid="ignore"):
        mean, quat = binding_pose(avatar.embedding, avatar.rules, avatar.training_per_bundle)
        for field, error in zip(("xyz", "rot"), _apart(avatar.gaussians, mean, quat), strict=True):
            row = int(np.argmax(error))
            if not error[row] <= BINDING_TOLERANCE:
                message = f"differs by {error[row]:.3g} from embedding.safetensors in the binding pose"
                yield Problem(f"gaussians.ply: {field}[{row}]", message)


def _apart(stored: Gaussians, mean: F32, quat: F32) -> tuple[F64, F64]:
    """[N] metres between the means, [N] distances between the unit quaternions, up to sign."""
    away = np.linalg.norm(stored.mean.astype(np.float64) - mean, axis=1)
    a, b = (q.astype(np.float64) for q in (stored.quat_wxyz, quat))
    a, b = (q / np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-12) for q in (a, b))
    return away, np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
