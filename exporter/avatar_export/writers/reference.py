"""reference/: vectors of every stage and images, to compare ports with, made by the runtime or the trainer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from avatar_export.version import GENERATOR
from avatar_export.writers.reference_cases import DRAWN, reference_cases
from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance import Case, Maker, Reference, encode, make_reference
from avatar_runtime.handedness import mirrored_pose
from avatar_runtime.stages.raster import PROFILES

FOLDER = "reference/"
IMAGES = tuple(
    f"{FOLDER}{case}.{profile}{kind}.png" for case in DRAWN for profile in PROFILES for kind in ("", ".alpha")
)
REFERENCE_FILES = (f"{FOLDER}cases.json", f"{FOLDER}vectors.safetensors", *IMAGES)


def make_for(
    avatar: Avatar, stored: Avatar, handedness: str, sha256: Mapping[str, str], maker: Maker
) -> Reference:
    """The reference of a bundle, by `maker`.

    `stored` is `avatar` in the frame of the normative files. `sha256`: path -> hash of these files, which later shows
    whether the reference still belongs to them.
    """
    cases = reference_cases(avatar)
    if handedness == "left":
        cases = tuple(map(_left, cases))
    return replace(make_reference(stored, cases, generator=GENERATOR, maker=maker), files=dict(sha256))


def reference_files(reference: Reference) -> dict[str, bytes]:
    """The files by their path in the bundle, some of REFERENCE_FILES: an avatar without clips has fewer images."""
    return {FOLDER + name: data for name, data in encode(reference).items()}


def reference_facts(reference: Reference) -> dict[str, Any]:
    """Its entry in the manifest: who made it, and for each case with images the difference between the profiles."""
    drawn = [c for c in reference.cases if c.images]
    cases = [{"name": c.case.name, "engine_psnr_db": c.engine_psnr_db} for c in drawn]
    return {"made_by": reference.made_by, "cases": cases}


def _left(case: Case) -> Case:
    return replace(case, pose=mirrored_pose(case.pose), camera=case.camera.mirrored())
