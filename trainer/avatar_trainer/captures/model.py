"""A capture in memory; `avatar_trainer.captures.load` makes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from avatar_runtime import Camera, PoseArrays, Rig

RIGHTS = ("source", "licence", "author", "consent")


@dataclass(frozen=True)
class Frame:
    """One image and what was tracked in it."""

    name: str  # of the image's file, without its ending; unlike all others
    image: Path  # 8-bit RGB (an alpha channel is not read)
    mask: Path  # 8-bit grey, 255 where the person is; if equal to `image`, its alpha channel
    camera: Camera
    pose: PoseArrays  # in the order of the capture's names
    split: str  # "train" | "test"
    over: float | None = (
        None  # the grey that is already behind the image's person, 0..1; None: straight colour
    )


@dataclass(frozen=True)
class Capture:
    """What training reads; made by `capture.load`."""

    name: str
    folder: Path
    width: int  # pixels, of every image
    height: int
    fps: float
    rig: Rig  # the body model with the subject's identity, metres
    expression_names: tuple[str, ...]  # [K] of the rig's morphs
    eyelids: tuple[str, ...]  # [L] eyelids
    head_pose_in: str  # avatar_runtime.rules.HEAD_POSE_IN
    frames: tuple[Frame, ...]
    export_inputs: Mapping[str, Path]  # the exporter's inputs besides a checkpoint: ReadOptions field -> file
    layout: str  # which layout was found, in words
    rights: Mapping[str, str] = field(default_factory=dict)  # the RIGHTS that the capture states
    notes: tuple[str, ...] = ()  # assumptions that were made
    poses: str = "exact"  # "estimated": training may refine them
    columns: tuple[int, ...] = ()  # the expressions that the files give, in their order; none: all

    @property
    def train(self) -> tuple[Frame, ...]:
        """The frames to train on, in order."""
        return tuple(frame for frame in self.frames if frame.split == "train")

    @property
    def test(self) -> tuple[Frame, ...]:
        """The frames held out, in order."""
        return tuple(frame for frame in self.frames if frame.split == "test")
