"""Runs reference vectors through a backend: every stage alone from its reference input, then whole pictures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import Backend, default_backend
from avatar_runtime.conformance.arrays import STAGE_ARRAYS
from avatar_runtime.conformance.checks import check_fits, check_rows
from avatar_runtime.conformance.judge import Verdict, judge
from avatar_runtime.conformance.model import CaseVectors, Reference, Step, View
from avatar_runtime.conformance.pictures import compare, view
from avatar_runtime.conformance.stages import at_pixels, run_stage
from avatar_runtime.player import Player
from avatar_runtime.subset import subset

# Units of 1/255 that colours may be off by in a picture, by the kind of target (option `target` of a backend that has
# one). One of fewer bits rounds at every blend: with 70,000 splats 1.44 and 6.1 were measured.
COLOUR_STEPS = {"rgba32f": 1.0, "rgba16f": 2.0, "rgba8": 7.0}


@dataclass(frozen=True)
class Row:
    """One array of one stage of one case."""

    case: str
    stage: str
    profile: str | None  # of stage raster
    array: str
    verdict: Verdict

    @property
    def passed(self) -> bool:
        return self.verdict.passed


@dataclass(frozen=True)
class PictureRow:
    """The whole avatar in one case and profile."""

    case: str
    profile: str
    difference: float  # largest, of colour and alpha, in units of 1/255, beyond what rounding to bytes hides
    tolerance: float  # the same units
    psnr_db: float | None  # in bytes, where either draws something; None: equal
    got: View
    want: View

    @property
    def passed(self) -> bool:
        return self.difference <= self.tolerance


@dataclass(frozen=True)
class Report:
    """What a backend made of a reference."""

    backend: str
    rows: tuple[Row, ...]
    pictures: tuple[PictureRow, ...]
    skipped: tuple[str, ...]  # what the backend does not draw, in words

    @property
    def passed(self) -> bool:
        return all(row.passed for row in self.rows) and all(row.passed for row in self.pictures)

    @property
    def first_failure(self) -> str | None:
        """The earliest stage that fails in any case; "picture" where all stages pass and a picture does not."""
        failed = {row.stage for row in self.rows if not row.passed}
        if failed:
            return next(stage for stage in STAGE_ARRAYS if stage in failed)
        return None if self.passed else "picture"


def conform(avatar: Avatar, reference: Reference, backend: str | None = None, **options: Any) -> Report:
    """`reference` of `avatar` on a backend with its `options`; None takes the default backend.

    Raises AvatarError where the reference is not one of `avatar` or the backend's library is missing, ValueError for
    an unknown backend.
    """
    check_rows(reference, avatar)
    part = subset(avatar, reference.rows, reference.vertices).avatar
    check_fits(reference, avatar, part)
    target = str(options.get("target", "rgba32f"))
    rows: list[Row] = []
    pictures: list[PictureRow] = []
    skipped: list[str] = []
    with (
        _released(Player(avatar, backend, **options)) as player,
        _released(Player(part, backend, **options)) as alone,
    ):
        for vectors in reference.cases:
            for step in vectors.steps:
                if step.profile is not None and step.profile not in alone.backend.profiles:
                    skipped.append(f"{vectors.case.name}: stage {step.stage} in profile {step.profile}")
                    continue
                rows += _stage_rows(avatar, alone.backend, reference, vectors, step, target)
            for profile, want in vectors.pictures.items():
                if profile in player.backend.profiles:
                    pictures.append(_picture(player, vectors, profile, want, target))
                else:
                    skipped.append(f"{vectors.case.name}: picture in profile {profile}")
    return Report(backend or default_backend(), tuple(rows), tuple(pictures), tuple(skipped))


@contextmanager
def _released(player: Player) -> Iterator[Player]:
    """A player whose backend gives back what it holds outside of Python, where it holds anything."""
    try:
        yield player
    finally:
        release = getattr(player.backend, "release", None)
        if release is not None:
            release()


def _stage_rows(
    avatar: Avatar, backend: Backend, reference: Reference, vectors: CaseVectors, step: Step, target: str
) -> Iterator[Row]:
    inputs = {array: reference.tensors[name] for array, name in step.inputs.items()}
    got = run_stage(avatar, backend, step.stage, step.profile, inputs, vectors.case.camera)
    if step.pixels is not None:
        got = at_pixels(got, reference.tensors[step.pixels])
        if target != "rgba32f":
            coarse = {name: replace(e, atol=COLOUR_STEPS[target] / 255) for name, e in step.outputs.items()}
            step = replace(step, outputs=coarse)
    for array, verdict in judge(step, got, reference.tensors).items():
        yield Row(vectors.case.name, step.stage, step.profile, array, verdict)


def _picture(player: Player, vectors: CaseVectors, profile: str, want: View, target: str) -> PictureRow:
    case = vectors.case
    picture = player.frame(case.pose, case.camera, case.background, profile).picture
    difference, psnr = compare(picture, want)
    return PictureRow(case.name, profile, difference, COLOUR_STEPS[target], psnr, view(picture), want)
