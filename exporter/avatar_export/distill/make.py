"""Dumps in, a portable avatar out: the whole of `avatar-export distill` as one function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.distill import measure, residual, worth
from avatar_export.distill.build import Builder, rig_of
from avatar_export.distill.dumps.check import Checked
from avatar_export.distill.dumps.folder import OWNER
from avatar_export.distill.dumps.held import Split
from avatar_export.distill.embedded import learn_embedded
from avatar_export.distill.learn import Task, learn
from avatar_export.distill.mesh import Mesh, priors
from avatar_export.distill.prepare import Prepared, prepared
from avatar_export.distill.refuse import Sweep, refuse, sweep
from avatar_export.distill.skeleton import Skeleton
from avatar_export.levels.level import measured_contribution
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.notes.text import stored
from avatar_runtime.avatar import F64, Avatar, Rig
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.ownership import owned

BAKED = "baked clips"  # the form without a skeleton
BAKED_BELOW = 40.0  # dB: bases are tried where the drivers leave more
BAKED_GAIN = 1.0  # dB that bases must gain to be kept
# Where bases are tried, entries are dropped first that show least: so much of what the drivers leave they may show.
DROPPED = 0.4

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Candidate:
    """An avatar of one form, and its errors on held-out frames."""

    form: str
    avatar: Avatar
    errors: measure.Errors


@dataclass(frozen=True)
class Distilled:
    """The result, and everything that the report says of it."""

    avatar: Avatar
    form: str
    reason: Note
    checked: Checked
    frames: Split
    task: Task
    tried: tuple[Candidate, ...]
    errors: measure.Errors  # on held-out frames; of a baked avatar, an upper bound
    baked: measure.Errors | None  # with residual bases, where they are kept: an upper bound
    sweep: Sweep
    doubts: tuple[Note, ...]


def distill(
    folder: Path,
    *,
    rig: Rig | None = None,
    morph_names: Sequence[str] = (),
    accept_error: bool = False,
    written: Callable[[Distilled], None] = lambda _: None,
    progress: Progress = lambda _: None,
) -> Distilled:
    """Learn an avatar from the dumps in `folder`; `rig` with a mesh, its morphs `morph_names`, may help.

    `written` gets the result before it is refused, for the report. Raises AvatarError as `prepared`, for poses beyond
    the data that are not finite, and, without `accept_error`, for large errors on held-out frames.
    """
    with owned(OWNER):
        result = _distilled(prepared(folder, rig, morph_names, progress), progress)
        written(result)
        found = refuse(result.errors, accept_error)
        result = replace(result, doubts=(*result.doubts, *(one for one in found if one not in result.doubts)))
        return replace(result, avatar=_noted(result))


def _distilled(given: Prepared, progress: Progress) -> Distilled:
    task, frames, mesh = given.task, given.frames, given.mesh
    if task.skeleton is None:
        return _baked_alone(given, progress)
    tried = _candidates(task, mesh, frames, progress)
    best = max(tried, key=lambda one: one.errors.decibels)
    final, baked, reason = best, None, _reason(tried, best, mesh)
    if best.form == "skinning" and best.errors.decibels < BAKED_BELOW:
        best, share = _small(task, best, frames, progress)
        final, baked = _with_bases(task, mesh, best, share, frames, progress)
        reason = fact(reason.kind, **{**reason.values, "dropped": _figures(best)})
    return Distilled(
        avatar=final.avatar,
        form=final.form,
        reason=reason,
        checked=given.checked,
        frames=frames,
        task=task,
        tried=tuple(tried),
        errors=best.errors,
        baked=baked,
        sweep=sweep(best.avatar, _turns(task.skeleton, task), best.errors.height),
        doubts=given.doubts,
    )


def _candidates(task: Task, mesh: Mesh | None, frames: Split, progress: Progress) -> list[Candidate]:
    """Every form that can be tried, measured on held-out frames."""
    found = [_measured(task, "skinning", _skinned(task, mesh, progress), frames, progress)]
    if mesh is not None and len(mesh.rig.triangles):
        embedded = learn_embedded(task, mesh, progress)
        if embedded is not None:
            found.append(_measured(task, "embedding on the mesh", embedded, frames, progress))
    return found


def _skinned(task: Task, mesh: Mesh | None, progress: Progress) -> Avatar:
    builder = Builder(task)
    learn(task, lambda rows, _, fitted: builder.add(rows, fitted), _priors(task, mesh), progress)
    rig = None
    if task.skeleton is not None:
        rig = rig_of(task.skeleton, len(task.dumps.drivers.driver_names)) if mesh is None else mesh.rig
    return check_avatar(builder.avatar(rig))


def _priors(task: Task, mesh: Mesh | None) -> residual.Priors:
    """Skin weights of the mesh under each Gaussian, or none."""
    return (lambda _: None) if mesh is None else priors(task, mesh)


def _measured(task: Task, form: str, avatar: Avatar, frames: Split, progress: Progress) -> Candidate:
    check_avatar(avatar)
    share = measured_contribution(avatar)
    return Candidate(form, avatar, measure.errors(task, avatar, frames.held_out, share, progress))


def _small(task: Task, best: Candidate, frames: Split, progress: Progress) -> tuple[Candidate, F64]:
    """`best` without the entries that show least beside what it leaves, and each Gaussian's share in the picture."""
    progress("dropping what shows least")
    share = measured_contribution(best.avatar)
    weights = task.dumps.drivers.drivers[task.fitted]
    avatar = worth.lean(best.avatar, weights, share, DROPPED * worth.left(best.errors, share))
    found = measure.errors(task, check_avatar(avatar), frames.held_out, share, progress)
    part = worth.avatar_bytes(avatar) / worth.avatar_bytes(best.avatar)
    return Candidate(f"{best.form} with {100 * part:.0f} % of its bytes", avatar, found), share


def _with_bases(
    task: Task, mesh: Mesh | None, best: Candidate, share: F64, frames: Split, progress: Progress
) -> tuple[Candidate, measure.Errors | None]:
    """The avatar with residual bases if they are worth it, else `best`."""
    progress("learning residual bases")
    avatar = check_avatar(residual.with_bases(task, best.avatar, share, _priors(task, mesh)))
    baked = measure.errors(task, avatar, frames.held_out, None, progress)
    if baked.decibels < best.errors.decibels + BAKED_GAIN:
        return best, None
    return Candidate("skinning with residual bases in the clips", avatar, best.errors), baked


def _baked_alone(given: Prepared, progress: Progress) -> Distilled:
    extended = residual.bases_alone(given.task)
    avatar = _skinned(extended, None, progress)
    found = measure.errors(extended, avatar, given.frames.held_out, measured_contribution(avatar), progress)
    candidate = Candidate(BAKED, avatar, found)
    return Distilled(
        avatar, candidate.form, fact("no_skeleton"), given.checked, given.frames, extended, (candidate,), found, found,
        sweep(avatar, np.zeros(0), found.height), (*given.doubts, doubt("no_skeleton")),
    )  # fmt: skip


def _reason(tried: Sequence[Candidate], best: Candidate, mesh: Mesh | None) -> Note:
    why = "no mesh was given" if mesh is None else "the Gaussians do not follow the mesh"
    figures = "; ".join(map(_figures, tried))
    return fact("form", form=best.form, tried=figures, why=why if len(tried) == 1 else None, dropped=None)


def _figures(one: Candidate) -> str:
    return f"{one.form} {one.errors.rms:.3g} mm, {one.errors.decibels:.1f} dB"


def _turns(skeleton: Skeleton, task: Task) -> F64:
    """[J] largest rotation of each joint in the frames learnt from, radians; 0 for roots."""
    trace = np.trace(skeleton.delta[task.fitted][..., :3, :3], axis1=-2, axis2=-1)
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1)).max(axis=0)
    return np.where(skeleton.parents < 0, 0.0, angle)


def _noted(result: Distilled) -> Avatar:
    """The avatar with what happened in its provenance."""
    notes = [distilled_note(result), result.reason, *mended_notes(result.checked), *result.doubts]
    return replace(result.avatar, provenance={**result.avatar.provenance, "notes": stored(notes)})


def distilled_note(result: Distilled) -> Note:
    """How far the avatar is from the dumps."""
    errors, held_out = result.errors, result.form != BAKED
    figures = {"frames": len(errors.frames), "mm": errors.rms, "db": errors.decibels}
    return fact("distilled", held_out=held_out, **figures)


def mended_notes(checked: Checked) -> list[Note]:
    """What was wrong in the dumps and is right in the avatar."""
    return [fact("mended", what=note) for note in checked.mended]
