"""An ordinary Avatar from what was learnt: entries that can be seen, a rig of joints, clips of the takes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from avatar_export.distill.dumps.folder import Dumps
from avatar_export.distill.learn import Fitted, Task
from avatar_export.distill.skeleton import Skeleton, local
from avatar_export.sparse import SparseRowsBuilder, no_shifts
from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Clip,
    Driving,
    Expression,
    Gaussians,
    Group,
    RasterSettings,
    Rig,
    Rules,
    SparseRows,
)
from avatar_runtime.driving.arkit import canonical

SYSTEM = "distilled"
SEEN = {  # change over a driver's range below which an entry is dropped
    "mean": 5e-5,  # metres
    "quat_wxyz": 1.3e-3,  # half of 0.15 degrees
    "log_scale": 0.005,
    "opacity_logit": 0.025,
    "sh": 0.0025,
}
SHAPES: Mapping[str, tuple[int, ...]] = {
    "mean": (3,),
    "quat_wxyz": (4,),
    "log_scale": (3,),
    "opacity_logit": (),
}
GEOMETRY, APPEARANCE = ("mean", "quat_wxyz"), ("log_scale", "opacity_logit", "sh")
LEAST_RANGE = 1e-3


class Builder:
    """Collects fitted blocks, in order, and makes the avatar."""

    def __init__(self, task: Task) -> None:
        self.task = task
        rows, names = task.layout.rows, task.dumps.drivers.driver_names
        count = task.layout.sh_count
        self._shapes = {**SHAPES, "sh": (count, 3)}
        used = task.dumps.drivers.drivers[task.fitted]
        self.low, self.high = used.min(axis=0), used.max(axis=0)
        self._base: dict[str, Any] = {
            name: np.zeros((rows, *shape), np.float32) for name, shape in self._shapes.items()
        }
        turning = 0 if task.skeleton is None else len(task.skeleton.turning)
        joints = 0 if task.skeleton is None else task.skeleton.count
        self._geometry = self._sparse(rows, len(names), GEOMETRY)
        self._appearance = self._sparse(rows, len(names), APPEARANCE)
        self._correctives = SparseRowsBuilder(rows, 9 * turning, {"mean": (3,)}, {"mean": 0.0})
        self._skin = SparseRowsBuilder(rows, joints, {"weight": ()}, {"weight": 0.0})

    def _sparse(self, rows: int, columns: int, names: tuple[str, ...]) -> SparseRowsBuilder:
        shapes = {name: self._shapes[name] for name in names}
        return SparseRowsBuilder(rows, columns, shapes, dict.fromkeys(names, 0.0))

    def add(self, rows: slice, fitted: Fitted) -> None:
        """Add the coefficients of the next Gaussians, which the skeleton moves."""
        self._append(rows, fitted, GEOMETRY + APPEARANCE)
        if self.task.skeleton is None:
            self._correctives.append_empty(rows.stop - rows.start)
            self._skin.append_empty(rows.stop - rows.start)
            return
        turned = fitted.turned.reshape(rows.stop - rows.start, -1, 3)
        seen = self.task.columns.turns[self.task.fitted]
        reach = np.abs(seen).max(axis=0, initial=0).reshape(-1)
        visible = np.abs(turned).max(axis=2, initial=0) * reach > SEEN["mean"]
        self._correctives.append({"mean": turned * visible[..., None]})
        assert fitted.bound is not None
        self._skin.append({"weight": fitted.bound.weight.astype(np.float32)})

    def add_embedded(self, rows: slice, fitted: Fitted) -> None:
        """Add the coefficients of the next Gaussians, which a mesh moves: only sizes and colours."""
        self._append(rows, fitted, APPEARANCE)
        self._geometry.append_empty(rows.stop - rows.start)
        self._correctives.append_empty(rows.stop - rows.start)
        self._skin.append_empty(rows.stop - rows.start)

    def _append(self, rows: slice, fitted: Fitted, names: tuple[str, ...]) -> None:
        count = rows.stop - rows.start
        for name in names:
            self._base[name][rows] = fitted.constant[name].reshape(count, *self._shapes[name])
        for builder, part in ((self._geometry, GEOMETRY), (self._appearance, APPEARANCE)):
            if set(part) <= set(names):
                builder.append(self._visible(fitted, part, count))

    def _visible(self, fitted: Fitted, names: tuple[str, ...], count: int) -> dict[str, Any]:
        """Deltas of all drivers, zero where nobody could see them."""
        active = self.task.active
        reach = np.maximum(self.high - self.low, LEAST_RANGE)[active]
        visible = np.zeros((count, len(active)), bool)
        for name in names:
            change = np.abs(fitted.driven[name]).max(axis=2, initial=0) * reach
            visible |= change > SEEN[name]
        result = {}
        for name in names:
            dense = np.zeros((count, len(self.low), *self._shapes[name]), np.float32)
            kept = fitted.driven[name] * visible[..., None]
            dense[:, active] = kept.reshape(count, len(active), *self._shapes[name])
            result[name] = dense
        return result

    def avatar(self, rig: Rig | None) -> Avatar:
        """The avatar of all Gaussians that were added, on `rig`."""
        task, dumps = self.task, self.task.dumps
        n, names = task.layout.rows, dumps.drivers.driver_names
        base = Gaussians(**self._base)
        fps = float(dumps.document.get("fps", 30.0))
        return Avatar(
            name=dumps.name,
            gaussians=base,
            groups=(Group("body", 0, n, "none" if rig is None else "skin"),),
            rules=Rules(rotation="polar3" if task.turns else "none", sh_direction=task.sh_direction),
            expressions=tuple(
                Expression(name, range=(min(0.0, float(low)), max(0.0, float(high))))
                for name, low, high in zip(names, self.low, self.high, strict=True)
            ),
            eyelids=(),
            blendshapes=Blendshapes(
                self._geometry.finish(),
                self._appearance.finish(),
                self._corrective_rows(rig),
                no_shifts(n, of="mean"),
            ),
            skin=self._skin.finish(),
            rig=rig,
            sh_degree=base.sh_degree,
            driving=Driving(mode="names" if any(canonical(name) for name in names) else "none"),
            raster=RasterSettings(background=_background(dumps)),
            head_pose_in="mesh" if dumps.document["space"] == "world" else "camera",
            training_per_bundle=1 / dumps.unit,
            delta_threshold={},
            provenance=_provenance(dumps),
            clips=clips_of(task, fps),
        )

    def _corrective_rows(self, rig: Rig | None) -> SparseRows:
        """The correctives, their columns numbered as the rig's corrective joints are."""
        found = self._correctives.finish()
        if rig is None or self.task.skeleton is None:
            return found
        at = np.searchsorted(rig.corrective_joints, self.task.skeleton.turning)
        column = (9 * at[:, None] + np.arange(9)).reshape(-1).astype(np.uint16)
        moved = column[found.column] if found.entries else found.column
        return SparseRows(found.row_ptr, moved, found.values, 9 * len(rig.corrective_joints))


def _background(dumps: Dumps) -> Any:
    given = dumps.document.get("background", [0.0, 0.0, 0.0])
    return given if isinstance(given, str) else tuple(float(value) for value in given)


def _provenance(dumps: Dumps) -> dict[str, Any]:
    document = dumps.document
    rights = {name: document[name] for name in ("licence", "author", "consent") if name in document}
    source = {"source_commit": document["source"]} if "source" in document else {}
    return {"system": SYSTEM, **source, **rights, "notes": []}


def rig_of(skeleton: Skeleton, expressions: int) -> Rig:
    """A rig of joints, without a mesh."""
    nothing = {"position": (3,)}
    joints = skeleton.count
    return Rig(
        vertices=np.zeros((0, 3), np.float32),
        triangles=np.zeros((0, 3), np.uint32),
        morphs=SparseRows.empty(0, expressions, nothing),
        correctives=SparseRows.empty(0, 9 * len(skeleton.turning), nothing),
        late_morphs=SparseRows.empty(0, 0, nothing),
        skin=SparseRows.empty(0, joints, {"weight": ()}),
        joint_names=skeleton.names,
        parents=skeleton.parents,
        rest_local=local(skeleton.rest, skeleton.parents).astype(np.float32),
        inverse_bind_matrix=np.linalg.inv(skeleton.rest).astype(np.float32),
        joint_basis=skeleton.basis.astype(np.float32),
        corrective_joints=skeleton.turning.astype(np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )


def clips_of(task: Task, fps: float) -> tuple[Clip, ...]:
    """A clip of each take."""
    drivers = task.dumps.drivers
    clips = []
    for take in np.unique(drivers.take):
        at = np.flatnonzero(drivers.take == take)
        joints = 0 if task.skeleton is None else task.skeleton.count
        delta = np.zeros((len(at), 0, 4, 4)) if task.skeleton is None else task.skeleton.delta[at]
        clips.append(
            Clip(
                task.dumps.take_name(int(take)),
                fps,
                drivers.drivers[at].astype(np.float32),
                np.zeros((len(at), 0), np.float32),
                delta.astype(np.float32).reshape(len(at), joints, 4, 4),
                np.tile(np.eye(4, dtype=np.float32), (len(at), 1, 1)),
            )
        )
    return tuple(clips)
