"""Other readings of a capture: its cameras in another convention, its rows in another order, its masks inverted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from avatar_runtime import PoseArrays
from avatar_trainer.captures.checks.conventions import CONVENTIONS, View
from avatar_trainer.captures.mesh_raster import intrinsics
from avatar_trainer.captures.model import Capture


@dataclass(frozen=True)
class Reading:
    """One way to read a capture's numbers; the defaults are what is stated."""

    part: str  # of the capture that is read differently
    what: str  # that part is, in words
    mend: str  # what to do
    view: Callable[[View], View] = lambda view: view
    pose: Callable[[PoseArrays], PoseArrays] = lambda pose: pose
    row: Callable[[int, int], int] = lambda index, count: (
        index
    )  # the row that belongs to image `index` of `count`
    inverted: bool = False  # masks

    def of(self, capture: Capture, index: int) -> tuple[View, PoseArrays]:
        """Camera and pose of image `index`, so read."""
        frame = capture.frames[self.row(index, len(capture.frames))]
        camera = frame.camera
        view = View(
            intrinsics(camera),
            camera.camera_from_world.astype(float),
            frame.pose.world_from_avatar,
            capture.width,
            capture.height,
        )
        return self.view(view), self.pose(frame.pose)


STATED = Reading("", "as stated", "")
OFF = "one frame off: each row belongs to the image"


def readings(capture: Capture) -> tuple[Reading, ...]:
    """The readings in which a capture is wrong most often; STATED first."""
    return (
        STATED,
        *(Reading("cameras", c.what, c.mend, view=c.read) for c in CONVENTIONS),
        Reading("masks", "inverted: 255 is the background", "write 255 where the person is", inverted=True),
        *_names(capture),
        Reading(
            "frames",
            f"{OFF} before its own",
            "shift images or rows by one",
            row=lambda i, n: min(i + 1, n - 1),
        ),
        Reading(
            "frames", f"{OFF} after its own", "shift images or rows by one", row=lambda i, n: max(i - 1, 0)
        ),
        Reading(
            "frames",
            "in the reverse order of the images",
            "reverse images or rows",
            row=lambda i, n: n - 1 - i,
        ),
    )


def _names(capture: Capture) -> Iterable[Reading]:
    columns = list(capture.columns or range(len(capture.expression_names)))
    if len(columns) < 2:
        return

    def reversed_names(pose: PoseArrays) -> PoseArrays:
        weights = pose.expression_weights.copy()
        weights[columns] = weights[columns[::-1]]
        return replace(pose, expression_weights=weights)

    yield Reading(
        "expressions",
        "in the reverse order of their names",
        "reverse the names, or every row",
        pose=reversed_names,
    )
