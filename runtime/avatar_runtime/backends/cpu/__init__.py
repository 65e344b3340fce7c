"""Backend `cpu`: the stages as kernels that Numba compiles, with the results of backend `reference`.

Blend, bind and activate are one pass, timed as `bind`. Values that no expression changes are not written again.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends import Arrays
from avatar_runtime.backends.cpu.arrays import Base, Mesh, Out, PosedArrays, Sizes, read_only
from avatar_runtime.backends.cpu.deform import inputs as kernel_inputs
from avatar_runtime.backends.cpu.deform import mesh as mesh_kernels
from avatar_runtime.backends.cpu.deform import single_stage
from avatar_runtime.backends.cpu.deform.bindings import Binding, EmbeddedBinding, SkinnedBinding
from avatar_runtime.backends.cpu.deform.facing import Facing
from avatar_runtime.backends.cpu.draw.frame import RUN as DRAW_RUN
from avatar_runtime.backends.cpu.draw.frame import draw
from avatar_runtime.backends.cpu.draw.light import Lit, light
from avatar_runtime.backends.cpu.draw.screen import Screen
from avatar_runtime.backends.cpu.draw.shadow import shadow_map
from avatar_runtime.backends.cpu.jit import Scalar, inlined, kernel
from avatar_runtime.backends.cpu.lanes import (
    exponential,
    fma,
    intrinsic,
    lanes_above,
    lowest_bit,
    prefetch,
    take_next,
)
from avatar_runtime.backends.cpu.rotation import (
    Quat,
    matrix_from_quat,
    newton_step,
    quat_from_matrix,
    quat_multiply,
)
from avatar_runtime.backends.cpu.threads import thread_count, using
from avatar_runtime.camera import Camera
from avatar_runtime.light import LightArrays, turned
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.light import casting
from avatar_runtime.stages.raster import PROFILES, Image

# fmt: off
__all__ = [  # the backend, and what other kernels are built of
    "CpuBackend", "Mesh", "Quat", "Scalar", "exponential", "fma", "inlined", "intrinsic", "kernel", "lanes_above",
    "lowest_bit", "make", "matrix_from_quat", "newton_step", "prefetch", "quat_from_matrix", "quat_multiply",
    "read_only", "take_next", "thread_count", "using",
]
# fmt: on


def make(avatar: Avatar, threads: int | None = None) -> CpuBackend:
    """The kernels for `avatar` on `threads` threads (one a core, at most 8, by default).

    Raises ValueError for less than one thread, and for an avatar whose indices point outside its arrays.
    """
    return CpuBackend(avatar, thread_count(threads))


class CpuBackend:
    """Plays one avatar, for one thread at a time: each frame overwrites the arrays of this backend."""

    profiles = PROFILES

    def __init__(self, avatar: Avatar, threads: int) -> None:
        self.avatar = avatar
        self.threads = threads
        self._sizes = Sizes.of(avatar)
        self._blendable = kernel_inputs.blendable(avatar)
        self._rig = None if avatar.rig is None else kernel_inputs.rig_arrays(avatar.rig, self._sizes)
        binding = SkinnedBinding if avatar.embedding is None else EmbeddedBinding
        self._binding: Binding = binding(avatar, self._blendable)
        self._out = kernel_inputs.fresh_out(*self._blendable.base.sh.shape)
        self._facing = Facing(avatar) if avatar.relight is not None and turned(avatar) else None
        self._turn = threading.Lock()  # held while _out is written or read

    def mesh(self, posed: Posed, clock: Clock) -> F32:
        """Stages morph and skin of the rig."""
        p = self._posed(posed)
        vertices = clock.timed("morph", lambda: self._morph(p))
        return clock.timed("skin", lambda: self._skin(vertices, p))

    def animate(self, posed: Posed, clock: Clock) -> Splats:
        """Stages up to activate, in arrays of the caller's own."""
        out = kernel_inputs.fresh_out(*self._out.sh.shape)
        self._animate(posed, out, clock)
        return out.splats()

    def frame(self, posed: Posed, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """All stages."""
        with self._turn:
            vertices = self._animate(posed, self._out, clock)
            splats, raster, degree = self._out.splats(), self.avatar.raster, self.avatar.sh_degree
            lit = None if posed.light is None else self._lit(posed, posed.light, splats, vertices, clock)
            return draw(splats, camera, raster, degree, background, profile, self.threads, clock, lit)

    def draw(self, splats: Splats, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """Stages from `project` on."""
        raster, degree = self.avatar.raster, self.avatar.sh_degree
        return draw(splats, camera, raster, degree, background, profile, self.threads, clock)

    def _lit(
        self, posed: Posed, given: LightArrays, splats: Splats, vertices: F32 | None, clock: Clock
    ) -> Callable[[Screen], None]:
        """Stages `shadow`, at once, and `light`, of a screen."""
        relight, workers = self.avatar.relight, self.threads
        assert relight is not None
        shadow = None
        if given.shadow_offset[2]:
            if vertices is None and self._rig is not None:
                vertices = self.mesh(posed, clock)
            mesh = casting(self.avatar, vertices, posed.world_from_avatar)
            shadow = clock.timed("shadow", lambda: shadow_map(splats, given, mesh, workers))
        quat, normal = splats.quat_wxyz, None
        if self._facing is not None and vertices is not None:
            facing, world = self._facing, posed.world_from_avatar
            quat, normal = facing.quat_wxyz, clock.timed("light", lambda: facing.normals(vertices, world))
        lit = Lit.of(relight, given, shadow, normal)
        return lambda screen: clock.timed(
            "light", lambda: light(splats.mean, quat, lit, screen.splats, screen.radius, workers)
        )

    def release(self) -> None:
        """Nothing: arrays go with the backend, threads belong to the process."""

    def stage(self, name: str, inputs: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
        """One stage single_stage. Raises KeyError for an unknown stage, ValueError for arrays of the wrong shape."""
        if name in RUN:
            return RUN[name](self, inputs)
        return DRAW_RUN[name](self.avatar, inputs, camera, profile, self.threads)

    def _animate(self, posed: Posed, out: Out, clock: Clock) -> F32 | None:
        """Stages up to activate, into `out`; the vertices of the mesh that Gaussians are bound to."""
        vertices = self._vertices(posed, clock)
        p = self._posed(posed)
        clock.timed("bind", lambda: self._binding.animate(p, vertices, out, self.threads))
        return vertices

    def _morph(self, posed: PosedArrays) -> F32:
        rig = self._rig
        assert rig is not None
        out = np.empty(rig.template.shape, np.float32)
        mesh_kernels.morph(
            rig.template, rig.morphs, rig.correctives, posed.expression_weights, posed.pose_feature, out
        )
        return out

    def _skin(self, vertices: npt.NDArray[Any], posed: PosedArrays) -> F32:
        rig = self._rig
        assert rig is not None
        given = read_only(vertices, np.float32, rig.template.shape)
        out = np.empty(given.shape, np.float32)
        mesh_kernels.skin(given, rig.skin, posed.skin_matrix, rig.late_morphs, posed.late_weights, out)
        return out

    def _vertices(self, posed: Posed, clock: Clock) -> F32 | None:
        embedding = self.avatar.embedding
        if embedding is None:
            return None
        if posed.vertices is not None:
            return posed.vertices
        return embedding.canonical_vertices if self._rig is None else self.mesh(posed, clock)

    def _given(self, inputs: Arrays, names: Iterable[str]) -> PosedArrays:
        """The arrays of a frame that one stage alone reads."""
        return kernel_inputs.posed_arrays(self._sizes, **{name: inputs[name] for name in names})

    def _posed(self, posed: Posed) -> PosedArrays:
        return kernel_inputs.posed_arrays(
            self._sizes,
            posed.expression_weights,
            posed.pose_feature,
            posed.late_weights,
            posed.skin_matrix,
            posed.groups.matrix,
            posed.groups.rotation,
            posed.world_from_avatar,
        )


def _morph(backend: CpuBackend, x: Arrays) -> dict[str, Any]:
    names = ("expression_weights", "pose_feature")
    return {"vertices": backend._morph(backend._given(x, names))}


def _skin(backend: CpuBackend, x: Arrays) -> dict[str, Any]:
    posed = backend._given(x, ("skin_matrix", "late_weights"))
    return {"posed_vertices": backend._skin(x["vertices"], posed)}


def _blend(backend: CpuBackend, x: Arrays) -> dict[str, Any]:
    n, width = backend._blendable.base.sh.shape
    shapes = ((n, 3), (n, 3), (n, 4), (n,), (n, width))
    out = Base(*(np.empty(shape, np.float32) for shape in shapes))
    single_stage.blend(
        backend._blendable, backend._given(x, ("expression_weights",)), np.ones((n, 2), np.uint8), out
    )
    return out._asdict() | {"sh": out.sh.reshape(n, width // 3, 3)}


def _bind(backend: CpuBackend, x: Arrays) -> dict[str, Any]:
    n = len(backend._blendable.base.mean)
    blended = backend._blendable.base._replace(
        mean=read_only(x["mean"], np.float32, (n, 3)),
        log_scale=read_only(x["log_scale"], np.float32, (n, 3)),
        quat_wxyz=read_only(x["quat_wxyz"], np.float32, (n, 4)),
    )
    posed = backend._given(x, (name for name in kernel_inputs.FRAME if name in x))
    out = backend._binding.bind(blended, posed, x.get("posed_vertices"))
    rotation = out.sh_rotation.reshape(n, 3, 3)
    return {"mean": out.mean, "log_scale": out.scale, "quat_wxyz": out.quat_wxyz, "sh_rotation": rotation}


def _activate(backend: CpuBackend, x: Arrays) -> dict[str, Any]:
    n = len(backend._blendable.base.mean)
    out = kernel_inputs.fresh_out(n, 0)
    single_stage.activate(
        read_only(x["log_scale"], np.float32, (n, 3)),
        read_only(x["quat_wxyz"], np.float32, (n, 4)),
        read_only(x["opacity_logit"], np.float32, (n,)),
        out.scale,
        out.quat_wxyz,
        out.opacity,
    )
    return {"scale": out.scale, "quat_wxyz": out.quat_wxyz, "opacity": out.opacity}


RUN: dict[str, Callable[[CpuBackend, Arrays], dict[str, Any]]] = {
    "morph": _morph,
    "skin": _skin,
    "blend": _blend,
    "bind": _bind,
    "activate": _activate,
}
