"""Images of one still head from many sides, as views.json names them: see schema/CAPTURE.md."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm import NEUTRAL, check_names
from avatar_runtime import F32, F64, AvatarError
from avatar_runtime.io import of_file
from avatar_trainer.captures import image_files
from avatar_trainer.captures.documents import read_document
from avatar_trainer.captures.paths import inside

FILE = "views.json"
MAX_JSON_BYTES = 16 << 20
MAX_PIXELS = 200_000_000  # of all images together: they are held in memory
LEAST_FOCAL = 1.0  # pixels
FEWEST_SEEN = 6  # landmarks that a view's pose can be found from
LUMA = np.array([0.299, 0.587, 0.114], np.float32)


@dataclass(frozen=True)
class Views:
    """N images of one still head; the poses are not known."""

    name: str
    file: Path  # the file with the numbers
    intrinsics: F64  # [3, 3] K, pixels, pixel centres at half integers, no skew
    intensity: F32  # [N, H, W] grey, 0..1, display-referred
    mask: F32  # [N, H, W] 1 where the head is
    landmark_names: tuple[str, ...]  # [L]
    landmarks: F64  # [N, L, 2] pixels; not finite where hidden

    @property
    def seen(self) -> npt.NDArray[np.bool_]:
        """[N, L] which landmarks were found."""
        found: npt.NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(self.landmarks), axis=-1)
        return found

    def chosen(self, rows: npt.ArrayLike) -> Views:
        """Only the views `rows`."""
        kept = np.asarray(rows, np.int64)
        return replace(
            self, intensity=self.intensity[kept], mask=self.mask[kept], landmarks=self.landmarks[kept]
        )


def read(folder: Path) -> Views:
    """The views whose views.json is in `folder`.

    Raises AvatarError naming file and field: not of the schema, an invalid K or one with skew, an image or mask that
    is missing, of another size or damaged, rows of landmarks of the wrong length, a view with fewer than FEWEST_SEEN
    of them, more than MAX_PIXELS in all.
    """
    file = folder / FILE
    document = _document(file)
    names, entries = tuple(document["landmarks"]), document["views"]
    width, height = document["width"], document["height"]
    if width * height * len(entries) > MAX_PIXELS:
        raise AvatarError(
            f"has {len(entries)} images of {width}x{height}, more than {MAX_PIXELS} pixels; make them smaller",
            file=file,
        )
    landmarks = np.stack(
        [_landmarks(entry, len(names), file, f"views[{i}]") for i, entry in enumerate(entries)]
    )
    intensity, mask = (np.empty((len(entries), height, width), np.float32) for _ in range(2))
    for i, entry in enumerate(entries):
        image = inside(folder, entry["image"], file, f"views[{i}].image")
        matte = inside(folder, entry["mask"], file, f"views[{i}].mask")
        for path in (image, matte):
            _check_size(path, (width, height))
        intensity[i] = image_files.colour(image) @ LUMA
        mask[i] = image_files.matte(matte, image)
        if not (mask[i] >= 0.5).any():
            raise AvatarError("shows no head: no pixel is over half", file=matte)
    return Views(document["name"], file, _intrinsics(document["K"], file), intensity, mask, names, landmarks)


def _document(file: Path) -> dict[str, Any]:
    document = read_document(file, MAX_JSON_BYTES, "views", _refuse)
    with of_file(file):
        check_names(document["name"], [NEUTRAL])
    return document


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _intrinsics(values: list[list[float]], file: Path) -> F64:
    k = np.array(values, np.float64)
    rest = k.copy()
    rest[[0, 1, 0, 1], [0, 1, 2, 2]] = 0
    if not (min(k[0, 0], k[1, 1]) >= LEAST_FOCAL and (rest == np.diag([0, 0, 1])).all()):
        raise AvatarError(
            f"is not [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy of at least {LEAST_FOCAL:g}",
            file=file,
            field="K",
        )
    return k


def _landmarks(entry: dict[str, Any], count: int, file: Path, at: str) -> F64:
    """[L, 2], NaN for a landmark that was not found."""
    rows, field = entry["landmarks"], f"{at}.landmarks"
    if len(rows) != count:
        raise AvatarError(f"has {len(rows)} rows, the file names {count}", file=file, field=field)
    found = sum(row is not None for row in rows)
    if found < FEWEST_SEEN:
        raise AvatarError(
            f"has {found} landmarks; {FEWEST_SEEN} are the fewest that give a pose: leave the view out",
            file=file,
            field=field,
        )
    return np.array([[np.nan, np.nan] if row is None else row for row in rows], np.float64)


def _check_size(path: Path, size: tuple[int, int]) -> None:
    found = image_files.header(path)
    if (found.width, found.height) != size:
        raise AvatarError(
            f"is {found.width}x{found.height} pixels, {FILE} says {size[0]}x{size[1]}; all are of one size",
            file=path,
        )
