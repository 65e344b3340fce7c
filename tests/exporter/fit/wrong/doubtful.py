"""Mistakes that only statistics tell: rows, signs and channels out of order, and frames that are missing."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData

from avatar_runtime.driving.arkit import ARKIT_NAMES
from tests.exporter.fit.misfits import Given
from tests.exporter.fit.wrong import inputs
from tests.exporter.fit.wrong.inputs import Inputs, Make, clip_of, embedded, folder_of, of_rows, rows_of
from tests.exporter.fit.wrong.line import DOUBT, Line

FRAMES = 90
SYSTEMS = ("blendshapes", "trained", "points")
PROPERTIES = {"scale": "scales", "opacity": "opacities", "dc": "colours", "rot": "rotations"}


def _exchanged(values: Any) -> Any:
    return np.random.default_rng(3).permutation(values)


def _conjugated(quat: Any) -> Any:
    return quat * np.array([1, -1, -1, -1], quat.dtype)


def _one_column(values: Any) -> Any:
    changed = values.copy()
    changed[:, 1] = _exchanged(values[:, 1])
    return changed


def _offsets(signs: Sequence[int], share: float) -> Make:
    """A LAM zip whose offsets are mirrored."""

    def edit(folder: Path) -> None:
        path = next(folder.rglob("offset.ply"))
        ply = PlyData.read(io.BytesIO(path.read_bytes()))
        rows = ply["vertex"].data
        for axis, sign in zip("xyz", signs, strict=True):
            rows[axis] = of_rows(lambda values, sign=sign: sign * values, share)(rows[axis])
        ply.write(str(path))

    return folder_of("lam", edit)


def _mirrored() -> dict[str, Make]:
    found = {
        f"{system}, displacements of {share:.0%}": folder_of(
            system, embedded(system, "displacement", of_rows(np.negative, share))
        )
        for system in ("trained", "body", "points")
        for share in (1, 0.5)
    }
    axes = {"x": (-1, 1, 1), "y": (1, -1, 1), "all": (-1, -1, -1)}
    return found | {f"lam, {axis}": _offsets(signs, 1) for axis, signs in axes.items()}


def _missing(first: int, count: int) -> dict[str, Make]:
    """Frames left out of a clip: tracked poses, and expressions over time."""

    def head(given: Inputs, folder: Path) -> Given:
        source, options = given.head
        document = json.loads(options["poses"].read_text())
        del document["frames"][first : first + count]
        (folder / "flame_params.json").write_text(json.dumps(document))
        return source, options | {"poses": folder / "flame_params.json"}

    t, k = np.arange(FRAMES)[:, None], np.arange(len(ARKIT_NAMES))
    clip = clip_of(np.delete(0.5 + 0.5 * np.sin(t / (7 + k % 11) + k), slice(first, first + count), axis=0))

    return {
        f"head, {count} frames": head,
        f"blendshapes, {count} frames": inputs.with_option("blendshapes", clips=clip),
        f"lam, {count} frames": inputs.with_option("lam", clips=clip),
    }


LINES = (
    Line("quaternions in the order x, y, z, w", DOUBT, r"warning: [^/]*order x, y, z, w",
         rows_of(SYSTEMS, "rot", lambda q: q[:, [1, 2, 3, 0]], (1, 0.5))),
    Line("quaternions of the inverse rotations", DOUBT, r"warning: [^/]*of the inverse rotations",
         rows_of(SYSTEMS, "rot", _conjugated, (1, 0.5))),
    *(
        Line(f"rows of {what} exchanged", DOUBT, rf"warning: {what} of neighbours are not alike",
             rows_of(SYSTEMS, name, _exchanged, (1, 0.5)))
        for name, what in PROPERTIES.items()
    ),
    Line("rows of one column of scales or colours exchanged", DOUBT,
         r"warning: (scale_1|green) of neighbours are not alike",
         {f"{key}, {name}": make for name in ("scale", "dc")
          for key, make in rows_of(SYSTEMS, name, _one_column, (1,)).items()}),
    Line("Gaussians that are transparent", DOUBT, r"of the Gaussians are transparent",
         rows_of(("blendshapes", "trained", "lam"), "opacity", lambda o: np.full_like(o, -9), (0.5, 0.3))),
    Line("offsets from the mesh mirrored", DOUBT, r"to have the other sign", _mirrored()),
    Line("rows of displacements exchanged", DOUBT, r"are rows of the embedding exchanged",
         {f"{system}, {share:.0%} of the rows":
              folder_of(system, embedded(system, "displacement", of_rows(_exchanged, share)))
          for system in ("trained", "points") for share in (1, 0.5)}),
    Line("gaps in clips", DOUBT, r"are frames missing", _missing(30, 8) | _missing(41, 25)),
    Line("colours as blue, green, red", DOUBT, r"read as B, G, R",
         rows_of(("blendshapes", "trained", "points"), "dc", lambda c: c[:, ::-1], (1, 0.5))),
)  # fmt: skip
