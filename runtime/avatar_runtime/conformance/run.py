"""Runs reference vectors through a backend: every stage alone from its reference input, then whole images."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import Backend, default_backend
from avatar_runtime.conformance.arrays import JUDGED, STAGE_ARRAYS
from avatar_runtime.conformance.checks import CASES, check_fits, check_rows
from avatar_runtime.conformance.images import compare, view
from avatar_runtime.conformance.judge import Verdict, judge
from avatar_runtime.conformance.model import CaseVectors, Reference, Step, Tensor, View
from avatar_runtime.conformance.stages import at_pixels, run_stage
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.light import SHADOW_SIZE
from avatar_runtime.player import Player
from avatar_runtime.pose import resolve
from avatar_runtime.subset import subset

# How far the colours of an image may be off, in units of 1/255, by the kind of target (option `target` of a backend
# that has one). A target of fewer bits rounds each time a splat is composited: 1.44 and 6.1 were measured with
# 70,000 splats.
COLOUR_STEPS = {"rgba32f": 1.0, "rgba16f": 2.0, "rgba8": 7.0}


@dataclass(frozen=True)
class Row:
    """One array of one stage of one case."""

    case: str
    stage: str
    profile: str | None  # of stage raster
    array: str
    verdict: Verdict
    place: Mapping[str, int]  # of verdict.worst: Gaussian or vertex id, or x and y of the pixel or texel

    @property
    def passed(self) -> bool:
        """Whether the array agrees with its reference."""
        return self.verdict.passed


@dataclass(frozen=True)
class ImageRow:
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
        """Whether the image differs by no more than the tolerance."""
        return self.difference <= self.tolerance


@dataclass(frozen=True)
class Report:
    """How the outputs of a backend, or of a port, compare with a reference."""

    backend: str | None  # None: a port
    rows: tuple[Row, ...]
    images: tuple[ImageRow, ...]
    skipped: tuple[str, ...]  # in words: what the backend does not draw, or the port did not provide

    @property
    def passed(self) -> bool:
        """Whether every row and every image passed."""
        return all(row.passed for row in self.rows) and all(row.passed for row in self.images)

    @property
    def first_failure(self) -> str | None:
        """The earliest stage that fails in any case; "image" where all stages pass and an image does not."""
        failed = {row.stage for row in self.rows if not row.passed}
        if failed:
            return next(stage for stage in JUDGED if stage in failed)
        return None if self.passed else "image"


def conform(avatar: Avatar, reference: Reference, backend: str | None = None, **options: Any) -> Report:
    """Judges a backend, made with `options`, by `reference`, which belongs to `avatar`; None is the default backend.

    Raises AvatarError if the reference was not made for `avatar` or the backend's library is missing, ValueError for
    an unknown backend.
    """
    part = _checked(avatar, reference)
    target = str(options.get("target", "rgba32f"))
    rows: list[Row] = []
    images: list[ImageRow] = []
    skipped: list[str] = []
    with (
        Player(avatar, backend, **options) as player,
        Player(part, backend, **options) as alone,
    ):
        for vectors in reference.cases:
            for step in vectors.steps:
                if step.profile is not None and step.profile not in alone.backend.profiles:
                    skipped.append(_in_words(vectors, step))
                    continue
                rows += _stage_rows(avatar, alone.backend, reference, vectors, step, target)
            for profile, want in vectors.images.items():
                if profile in player.backend.profiles:
                    images.append(_image(player, vectors, profile, want, target))
                else:
                    skipped.append(f"{vectors.case.name}: image in profile {profile}")
    return Report(backend or default_backend(), tuple(rows), tuple(images), tuple(skipped))


def conform_outputs(avatar: Avatar, reference: Reference, tensors: Mapping[str, Tensor]) -> Report:
    """Judges the arrays that a port computed from the reference inputs, named and shaped as the reference outputs.

    Numbers of any type are compared by value. A stage without any output is skipped; if only some of its outputs are
    given, the missing ones fail. Raises AvatarError if the reference was not made for `avatar`, for a name that is
    not an output, and if there are no outputs at all.
    """
    _checked(avatar, reference)
    check_given((step for c in reference.cases for step in c.steps), tensors)
    rows: list[Row] = []
    skipped: list[str] = []
    for vectors in reference.cases:
        for step in vectors.steps:
            named = {array: expected.tensor for array, expected in step.outputs.items()}
            got = {array: tensors[name] for array, name in named.items() if name in tensors}
            if got:
                rows += _rows(reference, vectors, step, got)
            else:
                skipped.append(_in_words(vectors, step))
    return Report(None, tuple(rows), (), tuple(skipped))


def check_given(steps: Iterable[Step], tensors: Mapping[str, Tensor]) -> None:
    """Raise AvatarError for a name that is no output of `steps`, and if there are no outputs at all."""
    known = {expected.tensor for step in steps for expected in step.outputs.values()}
    for name in tensors:
        if name not in known:
            raise no_such("output of this reference", name, sorted(known))
    if not tensors:
        raise AvatarError("holds no output of any stage")


def _checked(avatar: Avatar, reference: Reference) -> Avatar:
    """The part of `avatar` that the stages of its `reference` play."""
    check_rows(reference, avatar)
    part = subset(avatar, reference.rows, reference.vertices).avatar
    check_fits(reference, avatar, part)
    for vectors in reference.cases:
        try:
            resolve(vectors.case.pose, avatar)
        except AvatarError as error:
            field = ": ".join(filter(None, (vectors.case.name, error.field)))
            raise AvatarError(error.message, file=CASES, field=field) from None
    return part


def _in_words(vectors: CaseVectors, step: Step) -> str:
    profile = "" if step.profile is None else f" in profile {step.profile}"
    return f"{vectors.case.name}: stage {step.stage}{profile}"


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
    return _rows(reference, vectors, step, got)


def _rows(reference: Reference, vectors: CaseVectors, step: Step, got: Mapping[str, Tensor]) -> Iterator[Row]:
    for array, verdict in judge(step, got, reference.tensors).items():
        place = _place(reference, vectors, step, array, verdict)
        yield Row(vectors.case.name, step.stage, step.profile, array, verdict, place)


def _place(
    reference: Reference, vectors: CaseVectors, step: Step, array: str, verdict: Verdict
) -> dict[str, int]:
    """The Gaussian, vertex or pixel that the row of the worst element belongs to; empty for other arrays."""
    if verdict.worst is None:
        return {}
    row = verdict.worst.index[0]
    if step.pixels is not None:
        pixel, width = int(reference.tensors[step.pixels][row]), vectors.case.camera.width
        return {"x": pixel % width, "y": pixel // width}
    rows = {out.name: out.shape[0] for out in STAGE_ARRAYS[step.stage].outputs}[array]
    if rows == "N":
        return {"gaussian": int(reference.rows[row])}
    if rows == SHADOW_SIZE**2:
        return {"x": row % SHADOW_SIZE, "y": row // SHADOW_SIZE}
    return {"vertex": int(reference.vertices[row])} if rows == "V" else {}


def _image(player: Player, vectors: CaseVectors, profile: str, want: View, target: str) -> ImageRow:
    case = vectors.case
    player.light = case.light
    image = player.frame(case.pose, case.camera, case.background, profile).image
    difference, psnr = compare(image, want)
    return ImageRow(case.name, profile, difference, COLOUR_STEPS[target], psnr, view(image), want)
