"""The files of other people's networks: where they are, and that they are the ones that were measured."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from avatar_export.serving import talk
from avatar_runtime import AvatarError


@dataclass(frozen=True)
class ModelFile:
    """A network that ships here: its file, its SHA-256, and whose it is."""

    file: Path
    sha256: str
    source: str

    def path(self) -> Path:
        """Where it is. Raises AvatarError if it is missing or another one."""
        if not self.file.is_file():
            raise AvatarError("is missing; install avatar-export again", file=self.file)
        if hashlib.sha256(self.file.read_bytes()).hexdigest() != self.sha256:
            raise AvatarError("is not the file of this version; install avatar-export again", file=self.file)
        return self.file


LANDMARKER = ModelFile(
    talk.FOLDER / talk.MODEL, talk.FOREIGN[talk.MODEL], "MediaPipe face landmarker, Google, Apache-2.0"
)
SEGMENTER = ModelFile(
    Path(__file__).with_name("data") / "selfie_segmenter.tflite",
    "ea365e1048bd7cf4958beeb89bbf49cc012d43cfc53f6d82c5644dbaeec03500",
    "MediaPipe selfie segmentation, Google, Apache-2.0; metadata added",
)
