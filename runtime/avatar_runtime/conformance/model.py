"""Reference vectors in memory: cases, and the inputs and expected outputs of each stage of a case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import I64
from avatar_runtime.camera import Camera
from avatar_runtime.light import Light
from avatar_runtime.pose import Pose

Tensor = npt.NDArray[Any]
U8 = npt.NDArray[np.uint8]
MADE_BY = ("runtime", "trainer")


@dataclass(frozen=True)
class Case:
    """One pose seen by one camera over one background."""

    name: str  # a-z, 0-9 and _; also that of its images
    why: str  # what it catches
    pose: Pose
    camera: Camera
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)  # display-referred
    images: bool = True  # whether the whole avatar is drawn, in every raster profile
    light: Light | None = None  # of the scene; None: stages shadow and light do not run


@dataclass(frozen=True)
class Expected:
    """A reference output. An element may be off by atol * weight of its row + rtol * |reference|."""

    tensor: str  # a key of Reference.tensors
    atol: float
    rtol: float
    weight: str | None = None  # tensor [rows]; None: 1
    flips: str | None = None  # a key of arrays.FLIPS
    most_flips: int = 0  # rows or pixels that may lie on the other side of a threshold


@dataclass(frozen=True)
class Step:
    """One stage of a case; the inputs are the reference outputs of the stages before."""

    stage: str
    profile: str | None  # of stage raster
    inputs: Mapping[str, str]  # array -> tensor
    outputs: Mapping[str, Expected]  # by array
    pixels: str | None = None  # tensor [P], y * width + x: the pixels whose raster outputs are kept


@dataclass(frozen=True)
class View:
    """An image of the whole avatar in bytes: round(255 * clip(x, 0, 1)), ties up."""

    colour: U8  # [H, W, 3] display-referred, over the background
    alpha: U8  # [H, W] 1 - transmittance


@dataclass(frozen=True)
class CaseVectors:
    """A case and its reference."""

    case: Case
    steps: tuple[Step, ...]
    images: Mapping[str, View] = field(
        default_factory=dict
    )  # by raster profile; none where the case has none
    # Of the images, profile engine against trainer, in float32, where either draws; None: equal, or no images.
    engine_psnr_db: float | None = None


@dataclass(frozen=True)
class Reference:
    """Cases of one avatar. Stages play `rows` and `vertices` of it (`subset`), images the whole."""

    made_by: str  # one of MADE_BY
    generator: str
    avatar: str  # its name
    rows: I64  # [N] increasing Gaussian ids
    vertices: I64  # [V] increasing vertex ids
    tensors: Mapping[str, Tensor]
    cases: tuple[CaseVectors, ...]
    files: Mapping[str, str] = field(default_factory=dict)  # normative file of the bundle -> its sha256 then


@dataclass(frozen=True)
class DrivingCase:
    """One captured frame, or one pose, and what a player makes of it before stage `morph`."""

    name: str  # a-z, 0-9 and _
    why: str  # what it catches
    within_range: bool  # whether weights are limited to their ranges
    steps: tuple[Step, ...]  # `driving`, stage `joints`, or both


@dataclass(frozen=True)
class DrivingReference:
    """Cases of `driving` and of stage `joints` for one avatar, whose arrays are in the frame of `handedness`."""

    generator: str
    avatar: str  # its name
    handedness: str  # one of handedness.HANDEDNESS
    tensors: Mapping[str, Tensor]
    cases: tuple[DrivingCase, ...]
