"""A capture: frames of one person with masks, cameras and tracked parameters, and the body model they belong to.

`load` reads every layout that CAPTURE.md describes and checks all of it before training starts.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from avatar_export import ReadOptions
from avatar_runtime import F32, AvatarError
from avatar_trainer.captures import image_files, imavatar, metrical_tracker, own, vhap
from avatar_trainer.captures.model import Capture, Frame

# (the file that identifies a layout, its reader); the first match is used
LAYOUTS: tuple[tuple[str, Callable[[Path, ReadOptions], Capture]], ...] = (
    (own.FILE, own.read),
    (metrical_tracker.PATTERN, metrical_tracker.read),
    (imavatar.FILE, imavatar.read),
    (vhap.FILE, vhap.read),
)


def load(
    folder: Path,
    body_model: Path | None = None,
    eyelids: Path | None = None,
    anchor_faces: Path | None = None,
) -> Capture:
    """The capture in `folder`, of whichever layout it is.

    body_model, eyelids (folder), anchor_faces replace the files that the capture names or that are found beside it.
    Raises AvatarError that names file and row for everything that would stop or spoil training; see CAPTURE.md.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise AvatarError("is not a folder; a capture is a folder", file=folder)
    given = ReadOptions(body_model=body_model, eyelids=eyelids, anchor_faces=anchor_faces)
    for pattern, read in LAYOUTS:
        if next(folder.glob(pattern), None) is not None:
            return read(folder, given)
    known = ", ".join(pattern for pattern, _ in LAYOUTS)
    raise AvatarError(f"is not a capture: it holds none of {known}", file=folder)


def pixels(frame: Frame) -> tuple[F32, F32]:
    """(image [H, W, 3], mask [H, W]) of a frame, 0..1; the image is straight colour, not multiplied by the mask.

    Raises AvatarError for a damaged image and for one that is no longer of the camera's size.
    """
    size = (frame.camera.width, frame.camera.height)
    for path in (frame.image, frame.mask):
        found = image_files.header(path)
        if (found.width, found.height) != size:
            raise AvatarError(
                f"is now {found.width}x{found.height} pixels, was {size[0]}x{size[1]}", file=path
            )
    return image_files.person(frame.image, frame.mask, frame.over)


def check_pixels(capture: Capture) -> None:
    """Decode every image. Raises AvatarError for the first that is damaged, and for an empty mask."""
    for frame in capture.frames:
        if not pixels(frame)[1].any():
            raise AvatarError("is empty: it shows no person", file=frame.mask)
