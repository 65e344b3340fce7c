"""The files of a bundle, one row each: what it is called, whether it is derived, what makes its bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from avatar_runtime.avatar import Avatar
from avatar_runtime.codec import ply, safetensors
from avatar_runtime.codec.tensors import gaussian_tensors, rig_tensors

Piece = bytes | memoryview
PLY_COMMENTS = ("SplatRenderMode: default",)


@dataclass(frozen=True)
class Writer:
    """One file of the bundle."""

    path: str
    derived: bool  # nothing is lost without it; the runtime never opens it
    pieces: Callable[[Avatar], Iterable[Piece] | None]  # None: this avatar has no such file


def _gaussians(avatar: Avatar) -> Iterable[Piece]:
    return [ply.encode(avatar.gaussians, PLY_COMMENTS)]


def _blendshapes(avatar: Avatar) -> Iterable[Piece]:
    return safetensors.encode(gaussian_tensors(avatar))


def _rig(avatar: Avatar) -> Iterable[Piece] | None:
    return None if avatar.rig is None else safetensors.encode(rig_tensors(avatar.rig))


def _preview(avatar: Avatar) -> Iterable[Piece]:
    from avatar_export.pictures import contact_sheet, png  # draws the avatar: slow, and not always wanted

    return [png(contact_sheet(avatar))]


WRITERS = (
    Writer("gaussians.ply", False, _gaussians),
    Writer("blendshapes.safetensors", False, _blendshapes),
    Writer("rig.safetensors", False, _rig),
    Writer("preview.png", True, _preview),
)
