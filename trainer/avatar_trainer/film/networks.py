"""MediaPipe on single pictures: landmarks and weights of a face, and where the person is."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType

import cv2
import mediapipe
import numpy as np
import numpy.typing as npt
from mediapipe.tasks import python as tasks
from mediapipe.tasks.python import vision

from avatar_runtime import F32, F64
from avatar_trainer.film.models import LANDMARKER, SEGMENTER, ModelFile

LANDMARKS = 478
OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0])
MOST_FACES = 2  # that are looked for: more than one is said
EDGE_RADIUS, EDGE_SOFTNESS = (
    8,
    (0.02 * 255) ** 2,
)  # of the guided filter: pixels at 512, variance of grey levels
SURE = (0.1, 0.9)  # of the network's share: what is person for certain

Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Face:
    """The largest face of a picture."""

    landmarks: F64  # [478, 2] pixels
    scores: F32  # [52] in the order of `SCORE_NAMES`
    rotation: F64  # [3, 3] camera from head, OpenCV
    faces: int  # in the picture, MOST_FACES at most


class Networks:
    """Both networks; used with `with`."""

    def __init__(self) -> None:
        self.score_names: tuple[str, ...] = ()
        faces = vision.FaceLandmarkerOptions(
            base_options=_options(LANDMARKER),
            running_mode=vision.RunningMode.IMAGE,  # VIDEO smooths, and lags behind
            output_face_blendshapes=True,
            output_facial_transformation_matrixes=True,
            num_faces=MOST_FACES,
        )
        people = vision.ImageSegmenterOptions(base_options=_options(SEGMENTER), output_confidence_masks=True)
        with _silent():
            self._landmarker = vision.FaceLandmarker.create_from_options(faces)
            self._segmenter = vision.ImageSegmenter.create_from_options(people)

    def __enter__(self) -> Networks:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._landmarker.close()
        self._segmenter.close()

    def face(self, picture: Picture) -> Face | None:
        """The largest face of a picture [H, W, 3]; None: there is none."""
        found = self._landmarker.detect(_image(picture))
        if not found.face_landmarks:
            return None
        size = np.array(picture.shape[1::-1])
        places = [np.array([(p.x, p.y) for p in face]) * size for face in found.face_landmarks]
        largest = int(np.argmax([np.ptp(at, axis=0).prod() for at in places]))
        scores = found.face_blendshapes[largest]
        self.score_names = tuple(one.category_name for one in scores)
        u, _, vt = np.linalg.svd(np.asarray(found.facial_transformation_matrixes[largest])[:3, :3])
        return Face(
            places[largest],
            np.array([one.score for one in scores], np.float32),
            OPENCV_FROM_OPENGL @ (u @ vt),
            len(places),
        )

    def person(self, picture: Picture) -> F32:
        """[H, W] 0..1 the person in a picture [H, W, 3], its edge drawn to that of the picture."""
        found = self._segmenter.segment(_image(picture)).confidence_masks[0].numpy_view()
        coarse = np.ascontiguousarray(found.reshape(picture.shape[:2]))
        grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)
        fine = guided(coarse, grey, EDGE_RADIUS * max(picture.shape) / 512)
        low, high = SURE
        result: F32 = np.clip((fine - low) / (high - low), 0, 1)
        return result


@contextmanager
def _silent() -> Iterator[None]:
    """No library writes to standard error: MediaPipe logs what only its authors understand, and has no switch."""
    try:
        kept = os.dup(2)
    except OSError:  # there is no standard error
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def guided(share: F32, grey: Picture, radius: float) -> F32:
    """`share` [H, W] with the edges of a grey picture (He, Sun and Tang 2010, eq. 4 to 8); radius in pixels."""
    side = 2 * max(round(radius), 2) + 1

    def mean(values: F32) -> F32:
        return np.asarray(cv2.boxFilter(values, -1, (side, side), borderType=cv2.BORDER_REFLECT))

    guide = grey.astype(np.float32)
    guide_mean, share_mean = mean(guide), mean(share)
    slope = (mean(guide * share) - guide_mean * share_mean) / (mean(guide**2) - guide_mean**2 + EDGE_SOFTNESS)
    result: F32 = mean(slope) * guide + mean(share_mean - slope * guide_mean)
    return result


def _options(model: ModelFile) -> tasks.BaseOptions:
    return tasks.BaseOptions(model_asset_path=str(model.path()))


def _image(picture: Picture) -> mediapipe.Image:
    return mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=np.ascontiguousarray(picture))
