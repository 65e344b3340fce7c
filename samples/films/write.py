"""A film as files: H.264 in MP4, and the truth of every frame."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.video.stream import VideoStream

from samples.films.motion import FPS
from samples.films.render import Scene

Array = npt.NDArray[Any]

FILM, TRUTH = "film.mp4", "truth.npz"
QUALITY = "21"  # libx264's crf: a phone's file is about as good


def write_film(scene: Scene, out: Path) -> Path:
    """Write film.mp4 and truth.npz into the folder `out`; the path of the film."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / FILM
    encode(scene.filmed(), path, scene.size, FPS)
    write_truth(scene, out / TRUTH)
    return path


def encode(frames: Iterator[Array], path: Path, size: int, fps: float) -> None:
    """Frames u8 [size, size, 3] as H.264."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(
            "libx264", rate=round(fps), options={"crf": QUALITY, "preset": "medium"}
        )
        assert isinstance(stream, VideoStream)
        stream.width = stream.height = size
        stream.pix_fmt = "yuv420p"
        for image in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode(None))


def write_truth(scene: Scene, path: Path) -> None:
    """Camera, poses, weights and the neutral head. `samples.films.truth.load` makes the rest again from them."""
    pose = [scene.camera_from_head(k) for k in range(scene.frames)]
    np.savez_compressed(
        path,
        film=scene.film.name,
        size=scene.size,
        fps=FPS,
        times=np.arange(scene.frames) / FPS,
        focal=scene.focal,
        principal=np.array([scene.size / 2, scene.size / 2]),
        R=np.array([r for r, _ in pose]),
        t=np.array([t for _, t in pose]),
        weights=scene.motion.weights,
        names=np.array(scene.person.names),
        neutral=scene.person.head.vertices.astype(np.float32),
        root=scene.motion.root,
        neck=scene.motion.neck,
        shift=scene.motion.shift,
    )
