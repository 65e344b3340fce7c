"""The options for a trained avatar and for the bundle that it becomes; see `options`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from avatar_export.options import Author, Clips, Consent, License, Option, ReadOptions, option
from avatar_export.readers.table import READERS
from avatar_export.writers.table import INFLUENCES
from avatar_runtime.handedness import HANDEDNESS

SYSTEMS = tuple(reader.system for reader in READERS)
System = Annotated[
    str | None,
    Option(
        f"System of the source, if it should not be detected: {', '.join(SYSTEMS)}.",
        choices=SYSTEMS,
        metavar="NAME",
    ),
]


@dataclass(frozen=True)
class SourceOptions(ReadOptions):
    """The options for a trained avatar: the reader's inputs, further clips, and statements for the manifest."""

    system: System = None
    driving: Path | None = option(None, "JSON matrix from the ARKit names to this avatar.")
    clips: Clips = ()
    license: License = None
    author: Author = None
    consent: Consent = None
    relight: bool = option(
        False,
        "Let the light of a scene replace that of the capture, which is estimated: see `render --light`.",
    )
    capture_light: Path | None = option(
        None, "JSON file with the light of the capture, for --relight, instead of an estimate."
    )


@dataclass(frozen=True)
class ConvertOptions(SourceOptions):
    """The further options for a bundle: see `writers.bundle.write_bundle`."""

    influences: int = option(
        INFLUENCES[0], "Joints per vertex in rig.glb: 4, or 8 (JOINTS_1).", choices=INFLUENCES
    )
    handedness: str = option(
        HANDEDNESS[0],
        f"Frame of the normative files: {' or '.join(HANDEDNESS)} (Unity, Unreal). glTF and USD do not change.",
        choices=HANDEDNESS,
    )
    preview: bool = option(True, "Do not draw preview.png.", ("--no-preview",), off=True)
    engine_files: bool = option(
        True, "Do not write glTF, USD and embedding.json.", ("--no-engine-files",), off=True
    )
    reference: bool = option(
        True, "Do not write reference/, which `conform` compares ports with.", ("--no-reference",), off=True
    )
