"""Compares a bundle's reference with what a backend computes, or with the arrays that a port wrote."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.checks.conform_coverage import Gap, gaps
from avatar_export.checks.reference import named_in_full, read_reference
from avatar_export.images import png
from avatar_export.packing.reference import conform_pack_driving, read_pack_reference
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import default_backend
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import Reference, Report, conform, conform_outputs
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import staged
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.packs import is_pack

MOST_BYTES = 64 << 20  # of a port's outputs; those of a reference are a tenth of it

Pixels = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Conformance:
    """What was compared, and how far it differs."""

    title: str  # the avatar, and the backend or file
    report: Report
    reference: Reference
    gaps: tuple[Gap, ...]  # what the reference does not test
    driving: Report | None = None  # of a pack that ARKit names drive

    @property
    def passed(self) -> bool:
        """Whether everything passed."""
        return self.report.passed and (self.driving is None or self.driving.passed)


def conform_bundle(
    bundle: Path,
    backend: str | None = None,
    outputs: Path | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Conformance:
    """The reference of a bundle or pack against a backend, by default the runtime's, or against the file `outputs`.

    `outputs` is a .safetensors of arrays under the names that reference/cases.json gives its outputs; nothing is played
    then. Raises AvatarError for a bundle that is unsound or has no reference, and for an unusable file.
    """
    progress("loading")
    avatar = load(bundle, as_stored=True)
    if is_pack(bundle):
        return _pack(bundle, avatar, backend, outputs, progress)
    read = opener(bundle)
    reference = read_reference(read_manifest(read), read)
    progress("playing" if outputs is None else "comparing")
    with named_in_full():
        if outputs is None:
            report = conform(avatar, reference, backend or default_backend())
            return _judged(avatar, reference, report, f"backend {report.backend}")
        report = _given(avatar, reference, outputs)
        return _judged(avatar, reference, report, f"outputs {outputs.name}")


def _pack(
    pack: Path, avatar: Avatar, backend: str | None, outputs: Path | None, progress: Callable[[str], None]
) -> Conformance:
    """The same by the folder beside a pack; driving is judged too."""
    reference = read_pack_reference(pack)
    progress("playing" if outputs is None else "comparing")
    if outputs is not None:
        report = _given(avatar, reference, outputs)
        return _judged(avatar, reference, report, f"outputs {outputs.name}")
    report, driving = (
        conform(avatar, reference, backend or default_backend()),
        conform_pack_driving(pack, avatar),
    )
    return _judged(avatar, reference, report, f"backend {report.backend}", driving)


def _judged(
    avatar: Avatar, reference: Reference, report: Report, who: str, driving: Report | None = None
) -> Conformance:
    return Conformance(f"{avatar.name}, {who}", report, reference, gaps(avatar, reference), driving)


def save_images(folder: Path, images: Mapping[str, Pixels]) -> None:
    """Write images [H, W, 3] by file name to a new folder, all or nothing. Raises AvatarError if that fails."""
    with staged(folder, force=False) as partial:
        partial.mkdir()
        for name, pixels in images.items():
            (partial / name).write_bytes(png(pixels))


def _given(avatar: Avatar, reference: Reference, file: Path) -> Report:
    """The report on the outputs in a file; errors name the file."""
    try:
        data = read_bytes(file, MOST_BYTES)
        return conform_outputs(avatar, reference, safetensors.decode(data, str(file)))
    except AvatarError as error:
        raise AvatarError(error.message, file=error.file or file, field=error.field) from None
