"""Arrays of the stages to and from the buffers of chunks, for a single stage and for downloads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl.interpreter import FLOAT4, Chunk
from avatar_runtime.program.gaussians import PROJECTED_PLANES, SPLAT_PLANES
from avatar_runtime.program.model import WORD

Arrays = Mapping[str, npt.NDArray[Any]]

# What lies where in Splats and Projected: (plane, first component, components).
SPLAT_PLACES = {
    "mean": (0, 0, 3),
    "opacity_logit": (0, 3, 1),
    "opacity": (0, 3, 1),
    "quat_wxyz": (1, 0, 4),
}
PROJECTED_PLACES = {
    "centre": (0, 0, 2),
    "depth": (0, 2, 1),
    "opacity": (0, 3, 1),
    "conic": (1, 0, 3),
    "radius": (1, 3, 1),
    "rgb": (2, 0, 3),
}


def put_splats(chunks: Sequence[Chunk], inputs: Arrays) -> None:
    """Splats and Sh from the arrays that a stage takes; arrays that are not given are 0."""
    for chunk in chunks:
        n, rows = chunk.run.count, slice(chunk.run.first, chunk.run.first + chunk.run.count)
        planes = _planes(SPLAT_PLANES, SPLAT_PLACES, inputs, rows)
        for name in ("log_scale", "scale"):
            if name in inputs:
                planes[2:5, :, 3] = inputs[name][rows].T
        if "sh_rotation" in inputs:
            planes[2:5, :, :3] = inputs["sh_rotation"][rows].transpose(1, 0, 2)
        chunk.splats.write(planes.tobytes())
        if "sh" in inputs:
            chunk.sh.write(np.ascontiguousarray(inputs["sh"][rows].reshape(n, -1).T, np.float32).tobytes())


def take_splats(chunks: Sequence[Chunk]) -> dict[str, F32]:
    """mean, quat_wxyz, scales (log or not), opacities (logit or not) and sh_rotation of all Gaussians."""
    planes = _joined([_read(chunk.splats, SPLAT_PLANES, chunk.run.count) for chunk in chunks], SPLAT_PLANES)
    return {
        "mean": planes[0, :, :3].copy(),
        "opacity": planes[0, :, 3].copy(),
        "quat_wxyz": planes[1].copy(),
        "scale": planes[2:5, :, 3].T.copy(),
        "sh_rotation": planes[2:5, :, :3].transpose(1, 0, 2).copy(),
    }


def take_sh(chunks: Sequence[Chunk], terms: int) -> F32:
    """[N, K, 3]."""
    parts = [np.zeros((0, terms, 3), np.float32)]
    for chunk in chunks:
        n = chunk.run.count
        flat = np.frombuffer(chunk.sh.read(WORD * 3 * terms * n), np.float32)
        parts.append(flat.reshape(3 * terms, n).T.reshape(n, terms, 3))
    return np.concatenate(parts)


def put_projected(chunks: Sequence[Chunk], inputs: Arrays) -> None:
    """Projected from the arrays that a stage takes; arrays that are not given are 0."""
    for chunk in chunks:
        rows = slice(chunk.run.first, chunk.run.first + chunk.run.count)
        chunk.projected.write(_planes(PROJECTED_PLANES, PROJECTED_PLACES, inputs, rows).tobytes())


def take_projected(chunks: Sequence[Chunk]) -> dict[str, npt.NDArray[Any]]:
    """The outputs of stage project for all Gaussians."""
    parts = [_read(chunk.projected, PROJECTED_PLANES, chunk.run.count) for chunk in chunks]
    planes = _joined(parts, PROJECTED_PLANES)
    found: dict[str, npt.NDArray[Any]] = {}
    for name, (plane, first, count) in PROJECTED_PLACES.items():
        found[name] = (
            planes[plane, :, first : first + count].reshape(-1, *([count] if count > 1 else [])).copy()
        )
    found["radius"] = found["radius"].astype(np.int32)
    return found


def _planes(count: int, places: Mapping[str, tuple[int, int, int]], inputs: Arrays, rows: slice) -> F32:
    planes = np.zeros((count, rows.stop - rows.start, 4), np.float32)
    for name, (plane, first, components) in places.items():
        if name in inputs:
            planes[plane, :, first : first + components] = inputs[name][rows].reshape(-1, components)
    return planes


def _read(buffer: moderngl.Buffer, planes: int, count: int) -> F32:
    return np.frombuffer(buffer.read(FLOAT4 * planes * count), np.float32).reshape(planes, count, 4)


def _joined(parts: list[F32], planes: int) -> F32:
    return np.concatenate([np.zeros((planes, 0, 4), np.float32), *parts], axis=1)
