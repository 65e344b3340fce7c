"""What was tracked in a film, as a file."""

from __future__ import annotations

import zipfile
import zlib
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64, I64, AvatarError
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.head import load_head_model

FILE = "track.npz"
LANDMARKS = 478


@dataclass(frozen=True)
class Looked:
    """T frames as the network sees them, in pixels of the frames that were looked at."""

    times: F64  # [T] seconds
    width: int
    height: int
    landmarks: F64  # [T, 478, 2]; 0 where no face is
    scores: F32  # [T, 52]
    score_names: tuple[str, ...]
    rotation: F64  # [T, 3, 3]
    faces: I64  # [T]
    glances: F32  # [T, 3] detail, light and change of the pictures (`judge.glance`)
    FILE: ClassVar[str] = "landmarks.npz"

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        part = path.with_suffix(".part")
        arrays: dict[str, Any] = {one.name: np.asarray(getattr(self, one.name)) for one in fields(self)}
        with part.open("wb") as file:
            np.savez(file, **arrays)
        part.replace(path)

    @staticmethod
    def load(path: Path) -> Looked | None:
        """Read the file that `save` wrote; None: it is not there, or damaged."""
        try:
            with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
                found: dict[str, Any] = {one.name: file[one.name] for one in fields(Looked)}
            found["score_names"] = tuple(found["score_names"].tolist())
            return Looked(**found | {name: found[name].item() for name in ("width", "height")})
        except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile, zlib.error):
            return None

    @property
    def seen(self) -> npt.NDArray[np.bool_]:
        """[T] whether there is a face."""
        return self.faces > 0


@dataclass(frozen=True)
class Track:
    """T frames of a film of one face. Camera space as `Fit`; pixels of the capture's images."""

    width: int
    height: int
    fps: float
    times: F64  # [T] seconds of the film
    corner: F64  # [2] of the capture's images, pixels of the upright film
    scale: float  # pixels of the capture's images in one of the film
    focal: float
    principal: F64  # [2]
    identity: F64  # [I] standard deviations of the head model's modes
    names: tuple[str, ...]  # [K] expressions of the head model
    weights: F32  # [T, K] 0..1
    rotation: F64  # [T, 3, 3] camera from head
    translation: F64  # [T, 3] metres
    seen: npt.NDArray[np.bool_]  # [T] whether a face was found; elsewhere stands the nearest frame's fit
    landmarks: F32  # [T, 478, 2]
    scores: F32  # [T, 52] MediaPipe's own weights
    score_names: tuple[str, ...]
    faces: I64  # [T] how many faces were found
    residual_px: F32  # [T] mean distance of the landmarks from the fitted head
    glances: F32  # [T, 3] as Looked
    turned: int  # degrees clockwise by which the film's stored frames were turned

    @staticmethod
    def of(
        fit: Fit,
        residual: F64,
        looked: Looked,
        places: F64,
        size: int,
        fps: float,
        corner: F64,
        scale: float,
        turned: int,
    ) -> Track:
        """Of the fit to the frames with a face; `places` [T, 478, 2] landmarks of all frames."""
        rows = np.flatnonzero(looked.seen)
        nearest = np.abs(np.arange(len(looked.times))[:, None] - rows).argmin(axis=1)
        return Track(
            size,
            size,
            fps,
            looked.times,
            corner,
            scale,
            fit.focal,
            fit.principal,
            fit.identity,
            load_head_model().expression_names,
            fit.weights[nearest].astype(np.float32),
            fit.rotation[nearest],
            fit.translation[nearest],
            looked.seen,
            places[rows][nearest].astype(np.float32),
            looked.scores,
            looked.score_names,
            looked.faces,
            residual[nearest].astype(np.float32),
            looked.glances,
            turned,
        )

    def with_fit(self, fit: Fit) -> Track:
        """The same film, fitted differently: `fit` is of the frames with a face."""
        rows = np.flatnonzero(self.seen)
        nearest = np.abs(np.arange(len(self.times))[:, None] - rows).argmin(axis=1)
        return replace(
            self,
            focal=fit.focal,
            identity=fit.identity,
            weights=fit.weights[nearest].astype(np.float32),
            rotation=fit.rotation[nearest],
            translation=fit.translation[nearest],
        )

    @property
    def fit(self) -> Fit:
        """The same as the stages of the fit have it."""
        return Fit(
            self.focal,
            self.principal,
            self.identity,
            self.weights.astype(np.float64),
            self.rotation,
            self.translation,
        )

    @property
    def looked(self) -> Looked:
        """What `judge` looks at."""
        places = self.landmarks.astype(np.float64)
        return Looked(
            self.times, self.width, self.height, places, self.scores, self.score_names, self.rotation, self.faces,
            self.glances,
        )  # fmt: skip

    def save(self, path: Path) -> None:
        """Write the file."""
        arrays: dict[str, Any] = {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)

    @staticmethod
    def load(path: Path) -> Track:
        """Read the file. Raises AvatarError for one that is damaged."""
        try:
            with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
                found = {field.name: file[field.name] for field in fields(Track)}
            for name in ("names", "score_names"):
                found[name] = tuple(map(str, found[name].tolist()))
            for name in ("width", "height", "fps", "focal", "scale", "turned"):
                found[name] = found[name].item()
            track = Track(**found)
            damaged = track._damaged()
        except (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile, zlib.error) as error:
            raise AvatarError(f"is no track of a film ({error})", file=path) from None
        if damaged is not None:
            raise AvatarError("is damaged; make the capture again from the film", file=path, field=damaged)
        return track

    def _damaged(self) -> str | None:
        """The first array that lacks a row, or holds what is no number."""
        frames = len(self.times)
        shapes = {
            "times": (frames,),
            "weights": (frames, len(self.names)),
            "rotation": (frames, 3, 3),
            "translation": (frames, 3),
            "seen": (frames,),
            "landmarks": (frames, LANDMARKS, 2),
            "scores": (frames, len(self.score_names)),
            "faces": (frames,),
            "residual_px": (frames,),
            "glances": (frames, 3),
        }
        for name, shape in shapes.items():
            array = np.asarray(getattr(self, name))
            if array.shape != shape or not (name == "glances" or np.isfinite(array).all()):
                return name
        return None
