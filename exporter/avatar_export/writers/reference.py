"""reference/: vectors of every stage and images, to compare ports with, made by the runtime or the trainer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from avatar_export.version import GENERATOR
from avatar_export.writers.reference_cases import DRAWN, reference_cases
from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance import Case, Maker, Reference, decode, encode, make_reference
from avatar_runtime.handedness import mirrored_light, mirrored_pose
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.raster import PROFILES

FOLDER = "reference/"
ABSURD = 1e4  # larger numbers than this are named where a reference cannot be made
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


def reference_files(reference: Reference, avatar: Avatar) -> dict[str, bytes]:
    """The files by their path in the bundle, some of REFERENCE_FILES: an avatar without clips has fewer images.

    Raises AvatarError as `readable`.
    """
    return {FOLDER + name: data for name, data in readable(reference, avatar).items()}


def readable(reference: Reference, avatar: Avatar) -> dict[str, bytes]:
    """The files of the reference of `avatar` by name.

    Raises AvatarError if nobody could read them, since the avatar's numbers are too large to be compared.
    """
    files = encode(reference)
    try:
        decode(lambda name, most: files[name])
    except AvatarError as error:
        message = f"cannot be made ({error}){_largest(avatar)}; mend the avatar, or make no reference"
        raise AvatarError(message, file=FOLDER.rstrip("/")) from None
    return files


def _largest(avatar: Avatar) -> str:
    """In words, the avatar's largest number if it is absurd, which is the likely reason for others that overflow."""
    parts: dict[str, Any] = {"gaussians": avatar.gaussians, "rig": avatar.rig, "embedding": avatar.embedding}
    parts |= {f"clip {clip.name}": clip for clip in avatar.clips}
    found = [
        (float(np.abs(array.astype(np.float64)).max(initial=0)), f"{part}.{name}", np.abs(array))
        for part, held in parts.items()
        if held is not None
        for name, array in vars(held).items()
        if isinstance(array, np.ndarray) and array.dtype == np.float32
    ]
    size, name, array = max(found, key=lambda one: one[0])
    row = int(np.unravel_index(int(np.argmax(array)), array.shape)[0])
    return f": the avatar's largest number is {size:.3g}, in {name} at row {row}" if size > ABSURD else ""


def reference_facts(reference: Reference) -> dict[str, Any]:
    """Its entry in the manifest: who made it, and for each case with images the difference between the profiles."""
    drawn = [c for c in reference.cases if c.images]
    cases = [{"name": c.case.name, "engine_psnr_db": c.engine_psnr_db} for c in drawn]
    return {"made_by": reference.made_by, "cases": cases}


def _left(case: Case) -> Case:
    light = None if case.light is None else mirrored_light(case.light)
    return replace(case, pose=mirrored_pose(case.pose), camera=case.camera.mirrored(), light=light)
