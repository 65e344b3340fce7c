"""The groups of a Gaussian Blendshapes model as the arrays of an avatar, built block by block."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from avatar_export.readers.gaussian_blendshapes.layout import EYELIDS, JOINTS, SYSTEM
from avatar_export.readers.gaussian_blendshapes.sources import FaceSource, MouthSource
from avatar_export.sparse import SparseRowsBuilder, no_shifts
from avatar_runtime.avatar import F32, Blendshapes, Gaussians, SparseRows
from avatar_runtime.io.errors import AvatarError

BLOCK = 512  # Gaussians per block: 5 MB of SH deltas
# Smaller deltas are rounding noise of the init terms ((Q - I) x0 + t in float32) and are dropped.
THRESHOLD = {"mean": 1e-8, "quat_wxyz": 1e-8, "log_scale": 1e-7, "opacity_logit": 1e-7, "sh": 1e-7}
FEATURES = 36


class Parts:
    """Collects the face and the teeth into one set of arrays, in metres, dropping deltas below `threshold`."""

    def __init__(
        self, face: FaceSource, mouths: list[MouthSource], columns: int, scale: float, exact: bool
    ) -> None:
        self.unit = np.float32(1 / scale)
        self.coefficients = face.coefficients
        self.threshold = dict.fromkeys(THRESHOLD, 0.0) if exact else dict(THRESHOLD)
        rows = face.count + sum(m.count for m in mouths)
        t = self.threshold
        self.static: list[dict[str, F32]] = []
        self.builders = {
            "geometry": SparseRowsBuilder(
                rows,
                columns,
                {"mean": (3,), "quat_wxyz": (4,)},
                {"mean": t["mean"], "quat_wxyz": t["quat_wxyz"]},
            ),
            "appearance": SparseRowsBuilder(
                rows,
                columns,
                {"log_scale": (3,), "opacity_logit": (), "sh": (face.coefficients, 3)},
                {name: t[name] for name in ("log_scale", "opacity_logit", "sh")},
            ),
            "correctives": SparseRowsBuilder(rows, FEATURES, {"mean": (3,)}, {"mean": 0.0}),
            "late_morphs": SparseRowsBuilder(rows, len(EYELIDS), {"mean": (3,)}, {"mean": 0.0}),
            "skin": SparseRowsBuilder(rows, len(JOINTS), {"weight": ()}, {"weight": 0.0}),
        }

    def read_face(self, face: FaceSource) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Add the face block by block; returns the rows of the file that were kept.

        Raises AvatarError if every row has a NaN.
        """
        kept = []
        for start in range(0, face.count, BLOCK):
            block = face.block(start, min(start + BLOCK, face.count))
            finite = _finite_rows(block)
            kept.append(start + np.flatnonzero(finite))
            if not finite.all():
                block = {part: {k: v[finite] for k, v in values.items()} for part, values in block.items()}
            self._append(block)
        rows = np.concatenate(kept)
        if not len(rows):
            raise AvatarError("every row has a NaN", file=face.file, owner=SYSTEM)
        return rows

    def read_mouth(self, mouth: MouthSource) -> None:
        """Add the Gaussians of teeth, which have no deltas. Raises AvatarError for another SH degree and for NaN."""
        stored, needed = mouth.static["sh"].shape[1], self.coefficients
        if stored != needed:
            raise AvatarError(
                f"has {stored} SH coefficients, but the face has {needed}", file=mouth.file, owner=SYSTEM
            )
        finite = np.logical_and.reduce(
            [np.isfinite(v.reshape(mouth.count, -1)).all(axis=1) for v in mouth.static.values()]
        )
        if not finite.all():
            raise AvatarError(f"row {int(np.argmin(finite))} has a NaN", file=mouth.file, owner=SYSTEM)
        self._append({"static": mouth.static})

    def finish(self, rigged: bool) -> tuple[Gaussians, Blendshapes, SparseRows]:
        """(Gaussians, blendshapes, skin weights) of all rows; without a rig no correctives and no weights."""
        static = {name: np.concatenate([part[name] for part in self.static]) for name in self.static[0]}
        n = len(static["mean"])
        parts = {name: builder.finish() for name, builder in self.builders.items()}
        if not rigged:
            parts["correctives"] = no_shifts(n, of="mean")
            parts["skin"] = SparseRows.empty(n, 0, {"weight": ()})
        skin = parts.pop("skin")
        return Gaussians(**static), Blendshapes(**parts), skin

    def _append(self, block: Mapping[str, Mapping[str, F32]]) -> None:
        static = dict(block["static"])
        static["mean"] = static["mean"] * self.unit
        static["log_scale"] = static["log_scale"] + np.log(self.unit)
        self.static.append(static)
        count = len(static["mean"])
        for name, builder in self.builders.items():
            if name in block:
                values = dict(block[name])
                if "mean" in values:
                    values["mean"] = values["mean"] * self.unit
                builder.append(values)
            else:
                builder.append_empty(count)


def _finite_rows(block: Mapping[str, Mapping[str, F32]]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    count = len(block["static"]["mean"])
    finite = np.ones(count, bool)
    for values in block.values():
        for value in values.values():
            with np.errstate(invalid="ignore"):  # inf - inf
                total = np.sum(value, dtype=np.float64)
            if not np.isfinite(total):
                finite &= np.isfinite(value.reshape(count, -1)).all(axis=1)
    return finite
