"""Avatars among other things in Godot: depth, viewports of all kinds, compositors of the user, life and end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.images import frame_camera, seen
from avatar_runtime.avatar import F32, F64
from avatar_runtime.backends.gl import make_scene
from avatar_runtime.backends.gl.backend import GlBackend
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.measured import Measure
from tests.players.godot import light
from tests.players.godot.desk import Job, eye, numbers
from tests.players.godot.pixels import Bools, box_depth, cut
from tests.players.godot.samples import Sample, sample, write_pack
from tests.players.played_cases import drawn
from tests.session.shared_folder import made_once

pytestmark = pytest.mark.godot
BYTE = 1 / 255
TWO = ("head_blendshapes", "head_points")
SIZE, OTHER_SIZE = 192, (240, 150)
BACKGROUND, RED = (0.04, 0.35, 0.8), (0.9, 0.2, 0.1)
SEPARATE = (  # Godot 4.6.3 of an empty project with this option
    "WARNING: The separate rendering thread feature is experimental. Feel free to try it since it will eventually "
    "become a stable feature.",
    "ERROR: This function (finalize) can only be called from the render thread.",
    "WARNING: ObjectDB instances leaked at exit (run with --verbose for details).",
)
KINDS: dict[str, tuple[Any, ...]] = {
    "forward_plus": ("forward_plus",),
    "mobile": ("mobile",),
    "separate": ("forward_plus", ("--render-thread", "separate"), SEPARATE),
}
PIXELS = 300  # that are computed one by one
BOX = (0.09, 0.07, 0.08)  # metres
TURN = homogeneous(matrix_from_rotvec(np.array([0.3, 0.5, 0.2])))
MSAA_4X, BILINEAR, FSR2 = 2, 0, 2  # of Godot
FRAMES = 20
STEEP = 5e-3  # metres a pixel
LIVES = {"forward_plus": 100, "mobile": 10, "separate": 10}


@dataclass(frozen=True)
class Scene:
    """A job that was played, and what it shows."""

    job: Job
    kind: str
    heads: tuple[Sample, Sample]
    camera: Camera
    boxes: dict[str, F64]  # world from box

    @property
    def is_forward(self) -> bool:
        """Whether there are TAA and FSR2."""
        return self.job.renderer == "forward_plus"


def places() -> tuple[F64, F64]:
    """Where two heads stand that hide parts of each other."""
    turns = matrix_from_rotvec(np.array([[0.0, 0.2, 0.0], [0.0, -0.5, 0.1]]))
    first, second = homogeneous(turns, np.array([[0.0, 0.0, 0.0], [0.07, 0.02, -0.03]]))
    return first, second


@pytest.fixture(scope="module")
def heads(tmp_path_factory: pytest.TempPathFactory) -> tuple[Sample, Sample]:
    def make(folder: Path) -> Path:
        for name in TWO:
            write_pack(name, folder)
        return folder

    folder = made_once(tmp_path_factory, "godot_two", make)
    first, second = (sample(folder / f"{name}.avatar", 4, SIZE) for name in TWO)
    return first, second


@pytest.fixture(scope="module", params=KINDS)
def scene(
    request: pytest.FixtureRequest, heads: tuple[Sample, Sample], tmp_path_factory: pytest.TempPathFactory
) -> Scene:
    """Everything, by one start of the engine."""
    job = Job(tmp_path_factory.mktemp(f"godot_scene_{request.param}"), *KINDS[request.param])
    camera, boxes = heads[0].cameras[1], boxes_of(heads[0])
    made = Scene(job, request.param, heads, camera, boxes)
    job.say("lags", 2 * bool(job.complaints))
    job.say("background", *BACKGROUND)
    job.camera(camera)
    _compositors(made)
    _show(made, 0)
    job.say("shot", "plain")
    _boxes(made)
    _viewports(made)
    _lights(made)
    _two(made)
    job.say("remove", "0")
    job.say("again", str(heads[0].file), LIVES[request.param])
    _show(made, 0)
    job.say("shot", "after")
    job.play()
    return made


def boxes_of(head: Sample) -> dict[str, F64]:
    """Turned boxes before the head and in it."""
    camera, middle = head.cameras[1], np.array([0.02, 0.015, 0.0, 1.0])
    low, high = seen(head.avatar, head.poses[1])
    front = eye(camera)[:3, 3] - (low + high) / 2
    out = front / np.linalg.norm(front) * 0.6 * float(np.linalg.norm(high - low))
    centre = (low + high) / 2 + middle[:3]
    return {
        "before": np.block([[TURN[:3, :3], (centre + out)[:, None]], [np.eye(4)[3:]]]),
        "inside": np.block([[TURN[:3, :3], (centre + 0.25 * out)[:, None]], [np.eye(4)[3:]]]),
    }


def _show(scene: Scene, index: int) -> None:
    """A head in its pose."""
    head = scene.heads[index]
    scene.job.avatar(str(index), head.file)
    scene.job.pose(str(index), head.avatar, head.poses[1])


def _compositors(scene: Scene) -> None:
    """One of the user before and after ours, on both nodes that take one; then none."""
    job = scene.job
    for on in ("environment", "camera"):
        job.say("compositor", f"{on} before", on)
        _show(scene, 0)
        job.say("shot", f"{on} before")
        job.say("compositor", "", "")
        job.say("shot", f"{on} away")
        job.say("compositor", f"{on} after", on)
        job.say("shot", f"{on} after")
        job.say("calls", f"{on} before", f"{on} before")
        job.say("calls", f"{on} with", f"{on} after")
        job.say("remove", "0")
        job.say("shot", f"{on} user alone")
        job.say("calls", f"{on} after", f"{on} after")
        job.say("compositor", "", "")


def _boxes(scene: Scene) -> None:
    for name, place in scene.boxes.items():
        scene.job.say("box", name, numbers(place), BOX, RED, False)
        scene.job.say("shot", name)
        if name == "inside":
            scene.job.say("viewport", "msaa_3d", MSAA_4X)
            scene.job.say("shot", "msaa")
            scene.job.say("viewport", "msaa_3d", 0)
        scene.job.say("remove", name)


def _viewports(scene: Scene) -> None:
    job, camera = scene.job, scene.camera
    job.camera(other_camera(scene.heads[0]))
    job.say("shot", "resized")
    job.camera(camera)
    job.say("viewport", "scaling_3d_scale", 0.5)
    job.say("shot", "half")
    if scene.is_forward:
        job.say("viewport", "scaling_3d_mode", FSR2)
        job.say("shot", "fsr2", FRAMES)
        job.say("viewport", "scaling_3d_mode", BILINEAR)
    job.say("viewport", "scaling_3d_scale", 1.0)
    if scene.is_forward:
        job.say("viewport", "use_taa", True)
        job.say("shot", "taa", FRAMES)
        job.say("viewport", "use_taa", False)
    job.say("shot", "plain again")


def _lights(scene: Scene) -> None:
    """A lit floor below the chin, seen with the head and without."""
    job = scene.job
    low, high = seen(scene.heads[0].avatar, scene.heads[0].poses[1])
    floor = homogeneous(np.eye(3), np.array([*((low + high) / 2)[:1], low[1] + 0.1 * (high - low)[1], 0.0]))
    job.say("light", "light", numbers(homogeneous(matrix_from_rotvec(np.array([-0.9, 0.5, 0.0])))))
    job.say("box", "floor", numbers(floor), [1.0, 0.01, 1.0], [0.6, 0.5, 0.4], True)
    job.say("box", "thrown", numbers(scene.boxes["before"]), BOX, [0.2, 0.7, 0.3], True)
    job.say("viewport", "use_hdr_2d", True)
    job.say("shot", "lit", 2)
    job.say("show", "0", False)
    job.say("shot", "lit without")
    job.say("show", "0", True)
    job.say("viewport", "use_hdr_2d", False)
    for name in ("light", "floor", "thrown"):
        job.say("remove", name)


def _two(scene: Scene) -> None:
    """Both heads, in two viewports of two sizes; then frames that must allocate nothing."""
    job = scene.job
    _show(scene, 1)
    for index, place in enumerate(places()):
        job.say("place", str(index), numbers(place))
    job.say("shot", "two")
    job.camera(other_camera(scene.heads[0]), "subviewport", "sub")
    job.say("shot_of", "sub", "sub")
    job.say("statistics", "first")
    job.say("frames", "0", FRAMES)
    job.say("statistics", "last")
    job.say("remove", "sub")
    job.say("remove", "1")


def other_camera(head: Sample) -> Camera:
    """Of another size and side."""
    return frame_camera(seen(head.avatar, head.poses[1]), *OTHER_SIZE, yaw=-0.4, pitch=0.2)


def wanted(scene: Scene, camera: Camera | None = None) -> F32:
    """The first head by backend `gl`."""
    head = scene.heads[0]
    return drawn(head.avatar, head.poses[1], camera or scene.camera)


def both(scene: Scene, camera: Camera) -> F32:
    """Both heads by backend `gl`: the place of an avatar is a movement of its pose, which comes before it."""
    backends: list[GlBackend] = []
    moved = []
    for head, place in zip(scene.heads, places(), strict=True):
        backends.append(GlBackend(head.avatar, backends[0].context if backends else None, target="rgba32f"))
        world = place @ np.asarray(head.poses[1].world_from_avatar)
        moved.append(Player(head.avatar, "reference").posed(replace(head.poses[1], world_from_avatar=world)))
    try:
        image = make_scene(backends).image(moved, camera)
    finally:
        backends[0].release()
    return np.dstack([image.colour, 1 - image.transmittance])


def shown_off(scene: Scene, name: str, image: F32 | F64, under: F64 | tuple[float, ...] = BACKGROUND) -> F64:
    """[H, W] how far the viewport is from an image over what is behind, beyond what Mobile's colours must be off."""
    want, shown = light.over(image, under), scene.job.viewport(name)
    is_exact = scene.is_forward
    off = (
        light.off(shown, light.display(want))
        if is_exact
        else light.beyond_rgb10a2(shown, want, image[..., 3:])
    )
    found: F64 = off.max(axis=-1)
    return found


@pytest.mark.parametrize("name", ["plain", "plain again", "after"])
def test_a_head_is_shown_whatever_was_before(scene: Scene, name: str) -> None:
    want = wanted(scene)
    assert light.off(scene.job.accumulated(name), want).max() <= BYTE
    assert shown_off(scene, name, want).max() <= BYTE


@pytest.mark.parametrize("name", ["before", "inside"])
def test_a_box_cuts_the_head_where_it_stands(scene: Scene, name: str, measured: Measure) -> None:
    """Pixel by pixel: splats whose centre is behind the box's surface are hidden, the others lie over it."""
    head, depth = scene.heads[0], box_depth(scene.boxes[name], BOX, scene.camera)
    is_box, whole, found = np.isfinite(depth), wanted(scene), scene.job.accumulated(name)
    outer = inner(~is_box)
    assert light.off(found, whole)[outer].max() <= BYTE
    rows, columns = np.nonzero(inner(is_box) & (whole[..., 3] > 0.1))
    assert len(rows) > PIXELS
    at = np.stack([columns, rows], axis=1)[np.linspace(0, len(rows) - 1, PIXELS).astype(int)]
    column, row = at.T
    want, sure = cut(head.avatar, head.poses[1], scene.camera, at, depth[row, column])
    off = float(light.off(found[row, column], want)[sure].max())
    measured("godot, pixel of a head that a box cuts", off, BYTE)
    assert sure.mean() > 0.9 and off <= BYTE
    hidden = whole[row, column, 3] - want[:, 3]
    assert hidden.mean() > 0.5 if name == "before" else want[:, 3].max() > 0.5 and hidden.max() > 0.05
    under = np.where(is_box[..., None], RED, BACKGROUND)
    assert shown_off(scene, name, found, under)[outer | inner(is_box)].max() <= BYTE


def inner(mask: Bools) -> Bools:
    """A mask without the pixels at its edge."""
    kept = mask.copy()
    for axis in (0, 1):
        for step in (1, -1):
            kept &= np.roll(mask, step, axis)
    return kept


def test_msaa_changes_edges_only(scene: Scene) -> None:
    """And what lies at steep faces: a sample beside the middle of a pixel has another depth there."""
    depth = box_depth(scene.boxes["inside"], BOX, scene.camera)
    is_box = np.isfinite(depth)
    slope = np.hypot(*np.gradient(np.where(is_box, depth, 0)))
    sure = inner(is_box & (slope < STEEP)) | inner(~is_box)
    assert inner(is_box & (slope < STEEP)).sum() > 0.5 * is_box.sum()
    assert light.off(scene.job.accumulated("msaa"), scene.job.accumulated("inside"))[sure].max() <= BYTE
    assert light.off(scene.job.viewport("msaa"), scene.job.viewport("inside"))[sure].max() <= BYTE


@pytest.mark.parametrize("name", ["resized", "half"])
def test_a_viewport_changes_its_size(scene: Scene, name: str) -> None:
    camera = replace(scene.camera, width=SIZE // 2, height=SIZE // 2)
    want = wanted(scene, camera if name == "half" else other_camera(scene.heads[0]))
    assert light.off(scene.job.accumulated(name), want).max() <= BYTE
    if name == "resized":
        assert shown_off(scene, name, want).max() <= BYTE


@pytest.mark.parametrize(("name", "size", "least"), [("taa", SIZE, 40), ("fsr2", SIZE // 2, 26)])
def test_filters_over_time_keep_the_head(
    scene: Scene, name: str, size: int, least: float, measured: Measure
) -> None:
    if not scene.is_forward:
        pytest.skip("the Mobile renderer has no such filter")
    want = light.display(light.over(wanted(scene), BACKGROUND))
    assert scene.job.accumulated(name).shape == (size, size, 4)
    decibels = -10 * np.log10(np.mean((scene.job.viewport(name) - want) ** 2))
    measured(f"godot, {name}, dB", float(decibels), least)
    assert decibels >= least


def test_a_head_lies_over_a_lit_scene(scene: Scene, measured: Measure) -> None:
    """The viewport keeps linear light here, so that what is behind is known well."""
    behind, found = scene.job.viewport("lit without"), scene.job.accumulated("lit")
    assert np.ptp(behind.reshape(-1, 3), axis=0).min() > 0.1
    want = light.over(found, light.display(behind))
    off = float(light.off(light.display(scene.job.viewport("lit")), light.display(want)).max())
    measured("godot, head in a lit scene", off, BYTE)
    assert off <= BYTE
    free = wanted(scene)
    assert (free[..., 3] - found[..., 3]).max() > 0.1 and light.off(found, free).min() <= BYTE


def test_two_heads_are_sorted_together(scene: Scene, measured: Measure) -> None:
    want = both(scene, scene.camera)
    off = float(light.off(scene.job.accumulated("two"), want).max())
    measured("godot, two avatars", off, BYTE)
    assert off <= BYTE and light.off(want, wanted(scene)).max() > 0.1
    assert shown_off(scene, "two", want).max() <= BYTE
    assert shown_off(scene, "sub", both(scene, other_camera(scene.heads[0]))).max() <= BYTE


def test_frames_sort_once_a_view_and_allocate_nothing(scene: Scene) -> None:
    first, last = (scene.job.answers[f"statistics {name}"] for name in ("first", "last"))
    assert last["views"] - first["views"] >= 2 * FRAMES  # of two viewports
    assert last["views"] - first["views"] == last["sorts"] - first["sorts"]
    assert last["splats"] == sum(head.avatar.gaussians.count for head in scene.heads)
    assert last["allocations"] == first["allocations"]


@pytest.mark.parametrize("on", ["environment", "camera"])
def test_a_compositor_of_the_user_stays(scene: Scene, on: str) -> None:
    """It may come before our node or after; both effects are called, and the user's goes on alone."""
    want, calls = wanted(scene), scene.job.answers
    for name in ("before", "away", "after"):
        assert shown_off(scene, f"{on} {name}", want).max() <= BYTE, name
    assert calls[f"calls {on} before"] >= 1 and calls[f"calls {on} after"] > calls[f"calls {on} with"] >= 1
    assert shown_off(scene, f"{on} user alone", np.zeros_like(want)).max() <= BYTE


def test_nodes_that_come_and_go_leave_nothing(scene: Scene) -> None:
    """The engine names what leaks when it ends: a job that was played has nothing of that."""
    assert [said for name, said in scene.job.answers.items() if name.startswith("error ")] == ["", ""]
