"""Stages sort and raster on the GPU: all chunks of all avatars in one order, instanced quads, one image."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.interpreter import Chunk
from avatar_runtime.backends.gl.programs import Dispatch, Programs
from avatar_runtime.backends.gl.sort import Sort
from avatar_runtime.backends.gl.state import drawing_into
from avatar_runtime.backends.gl.target import TARGETS, Target, check_depth, check_size
from avatar_runtime.camera import Camera
from avatar_runtime.program.chunks import MOST_ROWS
from avatar_runtime.stages.raster import Image

ORDERS = {
    "back_to_front": (moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA),
    "front_to_back": (moderngl.ONE_MINUS_DST_ALPHA, moderngl.ONE),
}
QUAD = 48  # bytes of one drawn instance
FLIP_Y = -1.0  # the first row of GL's target is the top one of the image
Depth = npt.NDArray[Any] | moderngl.Texture


class Drawing:
    """Chunks that are sorted and drawn as one, with their buffers and programs."""

    def __init__(
        self, gpu: Gpu, programs: Programs, chunks: Sequence[Chunk], target: str, order: str
    ) -> None:
        """Raises ValueError for an unknown target or order, AvatarError as `Sort`."""
        for value, known in ((target, TARGETS), (order, ORDERS)):
            if value not in known:
                raise ValueError(f"{value!r} is not one of {', '.join(known)}")
        self._gpu, self._programs, self._chunks = gpu, programs, chunks
        self._kind, self._order = target, order
        self.sort = Sort(gpu, programs, chunks)
        self._target: Target | None = None
        self._program = programs.draw("raster_vertex", "raster_pixel")
        self._constants = programs.constants("raster_vertex", {"image_size": (1, 1), "flip_y": FLIP_Y})
        piece = min(self.sort.count, gpu.limit // QUAD, MOST_ROWS)
        quads = gpu.buffer("Quads", QUAD * piece)
        names = [item["name"] for item in programs.table["raster_vertex"]["inputs"]]
        self._quads = gpu.hold(gpu.context.vertex_array(self._program, [(quads, "4f 4f 4f/i", *names)]))
        self._pieces = [
            (
                min(piece, self.sort.count - begin),
                self._gathers(quads, begin, min(piece, self.sort.count - begin)),
            )
            for begin in range(0, self.sort.count, max(piece, 1))
        ]

    def raster(self, camera: Camera, depth: Depth | None) -> Target:
        """Stage raster of the sorted splats: the accumulated image, valid until the next call."""
        target, context = self._sized((camera.width, camera.height)), self._gpu.context
        check_depth(depth, target.size)
        self._constants.set({"image_size": target.size})
        flags = moderngl.BLEND if depth is None else moderngl.BLEND | moderngl.DEPTH_TEST
        target.clear(depth)
        with drawing_into(context, target.framebuffer, flags):
            context.blend_func = ORDERS[self._order]
            context.blend_equation = moderngl.FUNC_ADD, moderngl.FUNC_ADD
            context.depth_func = "<="
            for instances, gathers in self._pieces:
                for kernel in gathers:
                    kernel.run()
                context.memory_barrier()
                self._constants.bind()
                self._quads.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=instances)
                context.memory_barrier()
        return target

    def _gathers(self, quads: moderngl.Buffer, begin: int, instances: int) -> list[Dispatch]:
        made = []
        for chunk, first in zip(self._chunks, self.sort.first, strict=True):
            buffers = {"Projected": chunk.projected, "Pairs": self.sort.pairs, "Quads": quads}
            values = {
                "count": self.sort.count,
                "begin": begin,
                "piece_count": instances,
                "first": first,
                "chunk_count": chunk.run.count,
                "reverse": self._order == "back_to_front",
            }
            made.append(self._programs.dispatch("raster_gather", instances, buffers, values))
        return made

    def _sized(self, size: tuple[int, int]) -> Target:
        if self._target is None or self._target.size != size:
            check_size(self._gpu.context, size)
            if self._target is not None:
                self._target.release()
                self._target = None
            self._target = Target(self._gpu, size, self._kind)
        return self._target


def over(accumulated: F32, background: F32) -> Image:
    """Premultiplied colour and alpha [H, W, 4] over `background` [3]."""
    transmittance = 1 - accumulated[..., 3]
    return Image(
        accumulated[..., :3] + transmittance[..., None] * background.astype(np.float32), transmittance
    )
