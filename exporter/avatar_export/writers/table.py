"""The table WRITERS: one row for each file of a bundle, with its name and the function that makes its bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from avatar_export.writers.embedding_json import embedding_json
from avatar_export.writers.reference import REFERENCE_FILES, make_for, reference_files
from avatar_export.writers.residual import engine_residual
from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.same import same_bytes, same_image
from avatar_export.writers.same_glb import same_glb
from avatar_export.writers.splats_glb import splats_glb
from avatar_export.writers.usd.compare import same_usd
from avatar_export.writers.usdz import same_usdz, usdz
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec import ply, safetensors
from avatar_runtime.codec.clips import clip_tensors
from avatar_runtime.codec.embedding import embedding_tensors
from avatar_runtime.codec.manifest import ENHANCER_FILE
from avatar_runtime.codec.tensors import gaussian_tensors, rig_tensors
from avatar_runtime.conformance import RUNTIME, Maker, Reference
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.ownership import of_file

Piece = bytes | memoryview
PLY_COMMENTS = ("SplatRenderMode: default",)
LEFT_COMMENT = "Handedness: left"  # x is negated, for left-handed viewers
INFLUENCES = (4, 8)  # joints a vertex of rig.glb
USDC = "rig.usdc"
PARTS = {  # part of a bundle -> whether its files are derived from others
    "avatar": False,  # normative, always written
    "enhancer": False,  # written if there is one; not needed to play, and not used by reference/
    "engine": True,
    "reference": True,
    "preview": True,
}


@dataclass(frozen=True)
class Export:
    """An avatar that is being written, and the options of its files."""

    avatar: Avatar  # right-handed, as are the files for engines, whose importers convert
    influences: int = INFLUENCES[0]
    handedness: str = "right"  # of the normative files
    maker: Maker = RUNTIME  # of reference/
    # Hashes of the normative files by path, set as they are written.
    sha256: dict[str, str] = field(default_factory=dict)

    @cached_property
    def stored(self) -> Avatar:
        """The avatar in the frame of the normative files."""
        return self.avatar if self.handedness == "right" else mirrored(self.avatar)

    @cached_property
    def reference(self) -> Reference:
        """The content of reference/; needs the hashes of the written normative files."""
        return make_for(self.avatar, self.stored, self.handedness, self.sha256, self.maker)

    @cached_property
    def reference_files(self) -> dict[str, bytes]:
        """The files of reference/ by path."""
        return reference_files(self.reference, self.stored)

    @cached_property
    def usdc(self) -> bytes:
        """rig.usdc, which avatar.usdz wraps."""
        # Loads USD, which takes 2 s, so only if it is written.
        from avatar_export.writers.usd.stage import rig_usdc

        with of_file(USDC):
            return rig_usdc(self.avatar)


@dataclass(frozen=True)
class Writer:
    """One file of the bundle."""

    path: str
    part: str  # one of PARTS
    pieces: Callable[[Export], Iterable[Piece] | None]  # None if this avatar has no such file
    same: Callable[[bytes, bytes], str | None] = same_bytes  # the difference between two versions of it
    problems: Callable[[Export], Iterable[str]] = lambda _: ()  # problems that validators of the format miss

    @property
    def derived(self) -> bool:
        """Whether the file is derived from others."""
        return PARTS[self.part]


def _gaussians(export: Export) -> Iterable[Piece]:
    comments = PLY_COMMENTS if export.handedness == "right" else (*PLY_COMMENTS, LEFT_COMMENT)
    return [ply.encode(export.stored.gaussians, comments)]


def _blendshapes(export: Export) -> Iterable[Piece]:
    return safetensors.encode(gaussian_tensors(export.stored))


def _rig(export: Export) -> Iterable[Piece] | None:
    rig = export.stored.rig
    return None if rig is None else safetensors.encode(rig_tensors(rig))


def _embedding(export: Export) -> Iterable[Piece] | None:
    embedding = export.stored.embedding
    return None if embedding is None else safetensors.encode(embedding_tensors(embedding))


def _clips(export: Export) -> Iterable[Piece] | None:
    clips = export.stored.clips
    return safetensors.encode(clip_tensors(clips)) if clips else None


def _light(export: Export) -> Iterable[Piece] | None:
    relight = export.stored.relight
    return None if relight is None else safetensors.encode({"normal": relight.normal})


def _enhancer(export: Export) -> Iterable[Piece] | None:
    enhancer = export.avatar.enhancer
    return None if enhancer is None else [enhancer.onnx]


def _usd_problems(export: Export) -> Iterable[str]:
    from avatar_export.writers.usd.checks import usd_problems  # loads USD

    return usd_problems(export.usdc)


def _preview(export: Export) -> Iterable[Piece]:
    from avatar_export.images import contact_sheet, png  # draws the avatar, which is slow and optional

    return [png(contact_sheet(export.avatar))]


def _reference(path: str) -> Writer:
    def pieces(export: Export) -> Iterable[Piece] | None:
        data = export.reference_files.get(path)
        return None if data is None else [data]

    return Writer(path, "reference", pieces)


WRITERS = (
    Writer("gaussians.ply", "avatar", _gaussians),
    Writer("blendshapes.safetensors", "avatar", _blendshapes),
    Writer("rig.safetensors", "avatar", _rig),
    Writer("embedding.safetensors", "avatar", _embedding),
    Writer("clips.safetensors", "avatar", _clips),
    Writer("light.safetensors", "avatar", _light),
    Writer(ENHANCER_FILE, "enhancer", _enhancer),
    Writer("embedding.json", "engine", lambda export: embedding_json(export.stored, export.handedness)),
    Writer("rig.glb", "engine", lambda export: rig_glb(export.avatar, export.influences), same_glb),
    Writer("splats.glb", "engine", lambda export: splats_glb(export.avatar), same_glb),
    Writer(USDC, "engine", lambda export: [export.usdc], same_usd, _usd_problems),
    Writer("avatar.usdz", "engine", lambda export: usdz([(USDC, export.usdc)]), same_usdz),
    *map(_reference, REFERENCE_FILES),
    Writer("preview.png", "preview", _preview, same_image),
)


def engine_facts(export: Export) -> dict[str, Any]:
    """The entry `engine` of the manifest: influences, and the errors of the files for engines in mm."""
    facts: dict[str, Any] = {"influences": export.influences}
    return facts if export.avatar.rig is None else facts | engine_residual(export.avatar, export.influences)
