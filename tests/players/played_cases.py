"""Packs of avatars under every rule and of distilled ones, with their references: made once for all players' tests."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.packing.reference import MINI
from avatar_export.packing.write import Prepared, driving_facts, pack, write
from avatar_export.version import GENERATOR
from avatar_export.writers.reference_cases import reference_cases
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.conformance import RUNTIME, Case, driving_cases, encode, encode_driving, make_reference
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.subset import subset
from tests.exporter.distill.avatars import DISTILLED, distilled_avatars
from tests.exporter.packing.cases import COARSE
from tests.runtime.backends import gl_cases
from tests.session.shared_folder import made_once

CASES = ("posed", "close")
HEAD = "head.avatar"


@dataclass(frozen=True)
class PlayedCase:
    """An avatar as its pack holds it; `folder` has the pack `HEAD` and the files of its reference."""

    avatar: Avatar
    folder: Path


def played_cases(factory: pytest.TempPathFactory) -> Mapping[str, PlayedCase]:
    """By name."""
    folder = made_once(factory, "played_cases", _make)
    folders = {name: folder / folder_name(name) for name in (*gl_cases.avatars(), *DISTILLED)}
    return {n: PlayedCase(decode_pack((at / HEAD).read_bytes(), n).avatar, at) for n, at in folders.items()}


def folder_name(name: str) -> str:
    """The name of a case as a name of a folder."""
    return name.replace(" ", "_")


def _make(folder: Path) -> Path:
    for name, source in {**gl_cases.avatars(), **distilled_avatars()}.items():
        own = folder / folder_name(name)
        own.mkdir()
        file = pack([source], COARSE, driving_facts(source)).file
        for part, data in {HEAD: file, **vectors(decode_pack(file, name).avatar)}.items():
            (own / part).write_bytes(data)
    return folder


def vectors(avatar: Avatar, names: Container[str] | None = CASES) -> dict[str, bytes]:
    """The files of a reference that a player needs, of the cases that pose everything, or of all for None.

    There are no images, which take time.
    """
    return vectors_of(avatar, [c for c in reference_cases(avatar) if names is None or c.name in names])


def vectors_of(avatar: Avatar, wanted: Sequence[Case]) -> dict[str, bytes]:
    """The same of cases."""
    cases = [replace(case, images=False) for case in wanted]
    reference = make_reference(avatar, cases, generator=GENERATOR, maker=RUNTIME)
    part = subset(avatar, reference.rows, reference.vertices).avatar
    assert part.packed is not None
    mini = write(Prepared((part,), part.packed.program, False), driving_facts(avatar)).file
    driving = driving_cases(avatar)
    return {**encode(reference), **(encode_driving(driving) if driving.cases else {}), MINI: mini}


def image_of(avatar: Avatar) -> F32:
    """[H, W, 4] of the pose and the camera of the cases."""
    return drawn(avatar, gl_cases.pose_of(avatar), gl_cases.camera())


def drawn(avatar: Avatar, pose: Pose, camera: Camera) -> F32:
    """[H, W, 4] premultiplied colour over black and alpha, by backend `gl`."""
    image = Player(avatar, "gl", target="rgba32f").frame(pose, camera, (0.0, 0.0, 0.0)).image
    return np.dstack([image.colour, 1 - image.transmittance])
