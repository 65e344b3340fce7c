"""Dumps that were judged as a whole, and the task of learning from them: what `distill` and `check` have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.dumps.check import Checked, check
from avatar_export.distill.dumps.folder import open_dumps
from avatar_export.distill.dumps.held import Split, split
from avatar_export.distill.evidence.conventions import settled
from avatar_export.distill.evidence.shifts import shift_doubts
from avatar_export.distill.evidence.size import size_doubts
from avatar_export.distill.learn import Task, sample_rows
from avatar_export.distill.mesh import Mesh, check_rest, joint_basis, mesh_of, ordered
from avatar_export.distill.skeleton import skeleton_of
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import Rig
from avatar_runtime.io.errors import AvatarError


@dataclass(frozen=True)
class Prepared:
    """Dumps that can be learnt from."""

    checked: Checked
    frames: Split
    task: Task
    mesh: Mesh | None
    doubts: tuple[Note, ...]


def prepared(
    folder: Path,
    rig: Rig | None = None,
    morph_names: Sequence[str] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Prepared:
    """The dumps in `folder`, judged; `rig` with a mesh, its morphs `morph_names`, may help.

    Raises AvatarError as `open_dumps`, `check` and `size_doubts`, and for a rig that did not pose the dumps.
    """
    dumps = open_dumps(folder)
    if rig is not None:
        if not dumps.drivers.joint_names:
            raise AvatarError("has no joints, so a rig cannot help", file=folder / DRIVERS)
        dumps = replace(dumps, drivers=ordered(dumps.drivers, rig))
    checked = check(dumps, progress)
    dumps, frames, mended = checked.dumps, split(checked.dumps), list(checked.mended)
    progress("looking whether skeleton, drivers and frames belong together")
    carries = rig is not None and len(rig.triangles) > 0
    names = dumps.drivers.driver_names
    basis = joint_basis(rig, morph_names, names) if rig is not None and carries else None
    skeleton = skeleton_of(dumps, frames.fitted, basis)
    if rig is not None:
        check_rest(dumps, rig)
    task = Task.of(dumps, checked.layout, frames.fitted, skeleton, checked.order)
    sample = task.rows(sample_rows(task.layout.rows))
    doubts = [*frames.doubts, *size_doubts(task, sample)]
    task = settled(task, sample, mended, doubts)
    doubts += [*shift_doubts(task, sample), *_unseen(task, carries)]
    mesh = mesh_of(rig, morph_names, names, skeleton) if rig is not None and skeleton and carries else None
    return Prepared(
        replace(checked, dumps=task.dumps, mended=tuple(mended)), frames, task, mesh, tuple(doubts)
    )


def _unseen(task: Task, carries: bool) -> list[Note]:
    """Doubts about what the dumps do not show."""
    found: list[Note] = []
    names = task.dumps.drivers.driver_names
    still = [name for index, name in enumerate(names) if index not in set(task.active.tolist())]
    if task.skeleton is not None:
        if still:
            more = f", {len(still)} in all" if len(still) > 1 else ""
            found.append(doubt("still_driver", driver=still[0], more=more))
        if task.skeleton.untaught:
            found.append(doubt("untaught", joints=task.skeleton.untaught, by_rig=carries))
    if task.dumps.document.get("camera"):
        found.append(doubt("one_camera"))
    return found
