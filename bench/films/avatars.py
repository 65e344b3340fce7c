"""What an avatar learnt of a film: frames held out, and the true head seen from the side, where no camera was.

An avatar is a folder that `avatar-export make` wrote: capture/, run/ and bundle/. The side is drawn from the truth, in
the light of the film. A film tells neither its lens nor size and distance of the head: both cameras, the true one and
the tracked one, go round the face by the same angle, so that at 0 degrees the avatar stands where the film shows it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from samples.films.truth import Truth, middle, side_camera

from avatar_runtime import Camera
from avatar_runtime import load as load_bundle
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.load import load as load_capture
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import evenly
from avatar_trainer.evaluation.bundle import evaluate_bundle
from avatar_trainer.head import load_tracking_head
from bench.films.tracks import face_region, mean, mean_head, tracked

Array = npt.NDArray[Any]

YAWS, FRAMES = (-30.0, 30.0), 8  # degrees; how many frames are seen from each side, of those that look
TRACK = "track.npz"  # of a capture
AHEAD = 8.0  # degrees at most past the film's camera
# Figure: what it is, and the least that the mean over all films must be.
FIGURES: dict[str, tuple[str, float]] = {
    "between": ("dB inside the mask, of frames held out between those of training", 29.0),
    "last": ("dB inside the mask, of the last frames, held out", 24.0),
    "side": ("dB inside the head, of the true head from 30 degrees aside", 22.0),
}


def figures(truth: Truth, made: Path, scratch: Path) -> dict[str, float]:
    """The figures of the avatar in the folder `made`; pictures of the side go to `scratch`."""
    evaluated = made / "run" / "evaluation.json"
    found = held_out(json.loads(evaluated.read_text("utf-8"))) if evaluated.is_file() else {}
    seen = aside(truth, load_capture(made / "capture"), scratch)
    result = evaluate_bundle(load_bundle(made / "bundle"), seen)
    return {**found, "side": result["splits"]["test"]["psnr_inside_db"]}


def held_out(evaluation: Mapping[str, Any]) -> dict[str, float]:
    """dB inside the mask of the frames held out: every so many, or the last ones, which show poses never trained on."""
    frames = [int(frame["frame"]) for frame in evaluation["frames"] if frame["split"] == "test"]
    apart = len(frames) > 1 and max(np.diff(sorted(frames))) > 1
    names = {"test": "between" if apart else "last", "test as tracked": "as tracked"}
    splits = evaluation["splits"]
    return {name: splits[split]["psnr_inside_db"] for split, name in names.items() if split in splits}


def aside(truth: Truth, capture: Capture, scratch: Path) -> Capture:
    """Poses of the capture from the sides: every frame is held out, its image is drawn from the truth."""
    scratch.mkdir(parents=True, exist_ok=True)
    sized = replace(truth, focal=truth.focal * capture.width / truth.size, size=capture.width)
    track = tracked(capture.folder / TRACK)
    lens = float(track.data["focal"]) / track.zoom / truth.focal
    ahead = np.abs([turn_of(truth, _film_frame(truth, capture, frame)) for frame in capture.frames])
    chosen = np.flatnonzero(ahead <= max(AHEAD, np.sort(ahead)[: len(YAWS)].max()))
    frames = [
        _turned(sized, capture, frame, yaw, lens, scratch)
        for frame in evenly([capture.frames[k] for k in chosen], FRAMES)
        for yaw in YAWS
    ]
    return replace(capture, frames=tuple(frames))


def turn_of(truth: Truth, frame: int) -> float:
    """Degrees that the head is turned away from the camera's axis, to its left or right."""
    ahead = truth.R[frame][:, 2]
    return float(np.degrees(np.arctan2(ahead[0], -ahead[2])))


def _film_frame(truth: Truth, capture: Capture, frame: Frame) -> int:
    return int(np.abs(truth.times - int(frame.name) / capture.fps).argmin())


def _turned(truth: Truth, capture: Capture, frame: Frame, yaw: float, lens: float, scratch: Path) -> Frame:
    """A frame from `yaw` degrees aside."""
    k = _film_frame(truth, capture, frame)
    rotation, shift = side_camera(truth, k, yaw)
    colour, alpha = truth.scene.rgba(k, (rotation, shift))
    name = f"{frame.name}_{yaw:+.0f}"
    straight = colour / np.maximum(alpha, 1e-6)[..., None]
    for part, values in (("image", straight), ("mask", truth.scene.head_share(k, (rotation, shift)))):
        picture = np.round(np.clip(values, 0, 1) * 255).astype(np.uint8)
        Image.fromarray(picture).save(scratch / f"{name}_{part}.png")
    camera = camera_round(truth, capture, frame, yaw, lens)
    image, mask = (scratch / f"{name}_{part}.png" for part in ("image", "mask"))
    return replace(frame, name=name, image=image, mask=mask, camera=camera, split="test", over=None)


def camera_round(truth: Truth, capture: Capture, frame: Frame, yaw: float, lens: float) -> Camera:
    """The tracked camera of a frame, gone round the face by `yaw` degrees, with the image of the truth's film.

    `lens`: the tracked focal length over the true one. The axis goes through the same pixel as that of `side_camera`,
    and as far behind the tracked face as behind the true one, for the size that the tracked head has.
    """
    k = _film_frame(truth, capture, frame)
    rows = load_tracking_head(mean_head())[1]
    face = face_region(mean_head())[rows]
    mesh = posed_mesh(capture.rig, frame.pose, joints(capture.rig, frame.pose))
    if len(mesh) != len(rows):
        raise ValueError(
            f"{capture.folder}: a mesh of {len(mesh)} vertices; that of the head model has {len(rows)}"
        )
    view = frame.camera.camera_from_world.astype(np.float64)
    tracked_depth = (mesh[face] @ view[2, :3] + view[2, 3]).mean()
    true_depth, axis = truth.vertices(k)[rows][face][:, 2].mean(), middle(truth, k)
    larger = tracked_depth / true_depth / lens  # the tracked head: both are as large in the image
    depth = tracked_depth + larger * (axis[2] - true_depth)
    axis = axis / axis[2] * (1 / lens, 1 / lens, 1) * depth
    rotation = side_camera(truth, k, yaw)[0]
    intrinsics = truth.scene.intrinsics.copy()
    intrinsics[[0, 1], [0, 1]] *= lens
    turned, origin = rotation @ view[:3, :3], rotation @ (view[:3, 3] - axis) + axis
    return Camera.from_opencv(turned, origin, intrinsics, capture.width, capture.height)


def table(rows: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    """Lines: a row for each film, the means, and what holds."""
    names = list(dict.fromkeys(name for values in rows.values() for name in values))
    yield f"{'film':8s}" + "".join(f"{name:>18s}" for name in names)
    for film, values in rows.items():
        yield f"{film:8s}" + "".join(f"{values.get(name, np.nan):18.2f}" for name in names)
    means = {name: mean([v.get(name, np.nan) for v in rows.values()]) for name in names}
    yield f"{'mean':8s}" + "".join(f"{means[name]:18.2f}" for name in names)
    yield ""
    for name, (what, least) in FIGURES.items():
        if name in means:
            holds = "holds" if means[name] >= least else "MISSED"
            yield f"{name:11s} {means[name]:6.2f} (at least {least:.2f}) {holds:7s} {what}"
