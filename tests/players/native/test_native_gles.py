"""The native player on OpenGL ES 3.1, OpenGL 4.3 and Direct3D 11: stages by the vectors, images by backend `gl`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.packing.write import prepare, write
from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl import make_scene
from avatar_runtime.backends.gl.backend import GlBackend
from avatar_runtime.camera import Camera
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.exporter.packing.cases import COARSE, levels_of
from tests.measured import Measure
from tests.players.native.gles import Job, desk_program
from tests.players.played_cases import HEAD, PlayedCase, folder_name, image_of, played_cases
from tests.players.test_unity_played import TWO, places
from tests.players.unity_play.frames import frame_of
from tests.runtime.backends import gl_cases
from tests.session.native import NATIVE

KINDS = ("es", "gl", pytest.param("d3d11", marks=pytest.mark.players))
EPSILON = float(np.finfo(np.float32).eps)
IMAGE_LIMIT = 64 * EPSILON  # an image sums some hundred products of float32
PLACED_LIMIT = 256 * EPSILON  # a place is multiplied with the camera, which rounds otherwise
BYTE = 1 / 255
SMALLER = ("GL_EXT_float_blend", "GL_EXT_color_buffer_float", "GL_EXT_color_buffer_half_float")
TARGETS = ("rgba32f", "rgba16f", "rgba8")
COMPOSITES = (
    (0, "blue", 1),
    (1, "blue", 1),
    (0, "-", 1),
    (0, "blue", 4),
)  # to linear light, over what, samples
EYES = {
    eye: Camera.orbit(np.array([x, 0.0, 0.0]), 0.7, 0.3, 0.1, 0.7, *gl_cases.SIZE)
    for eye, x in (("left", -0.032), ("right", 0.032))
}  # beside each other, metres


@dataclass(frozen=True)
class Played:
    """A job that was run, with the words of each line it printed."""

    job: Job
    said: list[list[str]]

    def of(self, word: str) -> list[list[str]]:
        """What follows a word."""
        return [line[1:] for line in self.said if line[0] == word]


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, PlayedCase]:
    """Avatars under every rule."""
    return played_cases(tmp_path_factory)


def off(found: F32, want: F32, limit: float) -> float:
    """The largest difference, as a share of what it may be."""
    assert want[..., 3].max() > 0.5
    return float(np.abs(found - want).max()) / limit


@pytest.mark.parametrize("kind", KINDS)
def test_every_avatar_repeats_its_reference_and_looks_as_by_backend_gl(
    kind: str, cases: Mapping[str, PlayedCase], tmp_path: Path, measured: Measure
) -> None:
    job = Job(tmp_path)
    job.say("begin", kind)
    job.camera(gl_cases.camera())
    for name, case in cases.items():
        job.add(case.folder / HEAD, case.avatar, gl_cases.pose_of(case.avatar))
        job.draw(folder_name(name))
        job.say("clear")
        job.say("conform", case.folder, "cases")
    job.say("end")
    played = Played(job, job.run(desk_program(kind)))
    rows = played.of("row")
    stages = {"morph", "skin", "blend", "bind", "activate", "project", "sort", "raster"}
    assert stages <= {row[1] for row in rows} and not [row for row in rows if row[-1] != "1"]
    assert played.of("passed") == [["1"]] * len(cases) and played.of("left") == [["0"]]
    measured(f"native {kind}, stages, share of the tolerance", max(float(row[-2]) for row in rows), 1)
    apart = {
        name: off(job.image(folder_name(name)), image_of(case.avatar), IMAGE_LIMIT)
        for name, case in cases.items()
    }
    measured(f"native {kind}, image, share of the tolerance", max(apart.values()), 1)
    assert not {name: value for name, value in apart.items() if value > 1}


@pytest.fixture(scope="module", params=KINDS)
def scene(
    request: pytest.FixtureRequest, cases: Mapping[str, PlayedCase], tmp_path_factory: pytest.TempPathFactory
) -> Played:
    """Two avatars in one scene, drawn in every way."""
    job = Job(tmp_path_factory.mktemp(f"gles_scene_{request.param}"))
    job.say("begin", request.param)
    job.camera(gl_cases.camera())
    for name, place in zip(TWO, places(), strict=True):
        case = cases[name]
        job.add(case.folder / HEAD, case.avatar, gl_cases.pose_of(case.avatar), place=place)
    job.say("twice")
    job.say("early")
    job.draw("both")
    job.draw("again")
    _see(job, cases)
    for reversed_depth in (0, 1):
        file = job.file(wall(bool(reversed_depth)).tobytes())
        job.draw(f"behind_{reversed_depth}", "depth", file, reversed_depth)
    for linear, name, samples in COMPOSITES:
        job.say("composite", linear, name, samples, job.folder / f"composite_{linear}_{name}_{samples}")
    for number, target in enumerate(TARGETS):
        job.say("target", number)
        job.draw(target)
    job.say("target", 0)
    job.say("show", 1, 0)
    job.draw("first")
    job.say("show", 1, 1)
    job.say("refused", cases[TWO[1]].folder / HEAD)
    job.draw("after")
    job.say("frames", 800 if request.param == "d3d11" else 200)  # wined3d grows for 200 frames, then no more
    job.say("lose")
    for at, (name, place) in enumerate(zip(TWO, places(), strict=True)):
        job.say("pose", at, job.pose(cases[name].avatar, gl_cases.pose_of(cases[name].avatar), place))
    job.draw("restored")
    job.say("end")
    if request.param == "es":
        for count in range(len(SMALLER) + 1):
            for name in SMALLER[:count]:
                job.say("alter", name)
            job.say("begin", "es")
            job.say("which")
            job.say("target", 0)
            job.say("end")
    return Played(job, job.run(desk_program(request.param)))


def _see(job: Job, cases: Mapping[str, PlayedCase]) -> None:
    """Both eyes see the pose that was deformed for the image before; a newer one waits."""
    case, place = cases[TWO[0]], places()[0]
    job.say("pose", 0, job.pose(case.avatar, Pose(), place))
    for eye, seen in EYES.items():
        job.camera(seen)
        job.draw(eye, "seen")
    job.camera(gl_cases.camera())
    job.say("pose", 0, job.pose(case.avatar, gl_cases.pose_of(case.avatar), place))


def wall(is_reversed: bool) -> F32:
    """Depths, first row on top: a wall before all in the image's upper half."""
    width, height = gl_cases.SIZE
    near, far = (1.0, 0.0) if is_reversed else (0.0, 1.0)
    rows = np.where(np.arange(height) < height // 2, near, far)
    return np.repeat(rows[:, None], width, axis=1).astype(np.float32)


@pytest.fixture(scope="module")
def wanted_scene(cases: Mapping[str, PlayedCase]) -> Mapping[str, F32]:
    """The scene by backend `gl`: the place of an instance is a movement of its pose, which comes before it."""
    backends: list[GlBackend] = []
    moved = []
    for name, place in zip(TWO, places(), strict=True):
        avatar = cases[name].avatar
        context = backends[0].context if backends else None
        backends.append(GlBackend(avatar, context, target="rgba32f"))
        pose = gl_cases.pose_of(avatar)
        world = place @ np.asarray(pose.world_from_avatar)
        moved.append(Player(avatar, "reference").posed(replace(pose, world_from_avatar=world)))
    try:
        whole = make_scene(backends)
        cameras = {"both": gl_cases.camera(), **EYES}
        images = {name: whole.image(moved, seen) for name, seen in cameras.items()}
        return {name: np.dstack([one.colour, 1 - one.transmittance]) for name, one in images.items()}
    finally:
        backends[0].release()


def test_two_eyes_share_one_pose(scene: Played, wanted_scene: Mapping[str, F32], measured: Measure) -> None:
    found = {eye: off(scene.job.image(eye), wanted_scene[eye], PLACED_LIMIT) for eye in EYES}
    measured("native, image of an eye, share of the tolerance", max(found.values()), 1)
    assert max(found.values()) <= 1
    assert float(np.abs(wanted_scene["left"] - wanted_scene["right"]).max()) > 0.1


def test_two_avatars_are_sorted_together(
    scene: Played, wanted_scene: Mapping[str, F32], measured: Measure
) -> None:
    both = wanted_scene["both"]
    found = off(scene.job.image("both"), both, PLACED_LIMIT)
    measured("native, image of two avatars, share of the tolerance", found, 1)
    assert found <= 1
    np.testing.assert_array_equal(scene.job.image("again"), scene.job.image("both"))
    assert float(np.abs(scene.job.image("first") - both).max()) > 0.1  # the other one is hidden
    assert scene.of("twice")[0][0] == "0" and "added before" in " ".join(scene.of("twice")[0])


@pytest.mark.parametrize("is_reversed", [0, 1])
def test_depth_hides_splats(scene: Played, is_reversed: int) -> None:
    found, whole = scene.job.image(f"behind_{is_reversed}"), scene.job.image("both")
    half = len(whole) // 2
    assert whole[:half, :, 3].max() > 0.5 and found[:half, :, 3].max() == 0
    np.testing.assert_array_equal(found[half:], whole[half:])


@pytest.mark.parametrize("kind", [KINDS[0], KINDS[2]])
def test_a_camera_takes_the_depth_of_an_engine(kind: str, tmp_path: Path) -> None:
    """Of a projection as OpenGL or Direct3D has it, and of one that is reversed in depth."""
    least = 0 if kind == "d3d11" else -1  # of a depth on the screen
    view = homogeneous(matrix_from_rotvec(np.array([0.1, 0.4, -0.2])), np.array([0.1, 0.2, -3.0]))
    points = np.array([[0.3, -0.2, 0.1, 1.0], [-0.5, 0.4, 1.0, 1.0]])
    for near, far in ((0.1, 50.0), (50.0, 0.1)):
        depth = [0, 0, (least * near - far) / (far - near), (least - 1) * far * near / (far - near)]
        projection = np.array([[1.5, 0, 0.1, 0], [0, 2, 0, 0], depth, [0, 0, -1, 0]])
        job, out = Job(tmp_path), tmp_path / "camera"
        job.say("depth_of", job.file(np.concatenate([view, projection]).astype("<f8").tobytes()), out)
        job.run(desk_program(kind))
        rows = np.fromfile(out, np.float32, 33)[17:].reshape(4, 4).astype(np.float64)
        clip = points @ (projection @ view).T
        want = (clip[:, 2] / clip[:, 3] - least) / (1 - least)
        np.testing.assert_allclose((points @ rows[2]) / (points @ rows[3]), want, atol=8 * EPSILON)


def test_the_image_is_put_over_a_framebuffer(scene: Played, wanted_scene: Mapping[str, F32]) -> None:
    both = wanted_scene["both"]
    blue, grey = np.array([0.25, 0.5, 1.0]), np.full(3, 128 / 255)  # as a byte holds it
    # Over what is there, a GPU rounds the image and its factor to bytes before it blends.
    for linear, name, samples in COMPOSITES:
        under, limit = (grey, 2) if name == "-" else (blue, 1)
        raw = np.fromfile(scene.job.folder / f"composite_{linear}_{name}_{samples}", np.uint8)
        found = raw.reshape(both.shape) / 255
        want = both[..., :3] + (1 - both[..., 3:]) * under
        if linear:
            want = np.where(want <= 0.04045, want / 12.92, ((want + 0.055) / 1.055) ** 2.4)
        assert np.abs(found[..., :3] - np.clip(want, 0, 1)).max() <= limit * BYTE, (linear, name)
        assert (raw.reshape(both.shape)[..., 3] == 255).all()


def test_targets_that_round(scene: Played, measured: Measure) -> None:
    exact = scene.job.image("rgba32f")
    apart = {target: float(np.abs(scene.job.image(target) - exact).max()) for target in TARGETS}
    measured("native, RGBA16F against RGBA32F", apart["rgba16f"], BYTE)
    assert apart["rgba32f"] == 0 and 0 < apart["rgba16f"] <= BYTE < apart["rgba8"] <= 24 * BYTE


def test_arguments_that_cannot_be_used_are_refused(scene: Played) -> None:
    """Every function of the header: NULL, what is not there, the wrong order. The next image is as before."""
    assert scene.of("taken") == []
    assert len(scene.of("refused")) > 20
    np.testing.assert_array_equal(scene.job.image("after"), scene.job.image("both"))
    table = "".join((NATIVE / "tests" / f"{name}.cpp").read_text() for name in ("refused_scene", "desk_gl"))
    for folder in ("gles", "d3d11"):
        header = (NATIVE / folder / f"avatar_{folder}.h").read_text()
        declared = re.findall(rf"AVATAR_API [^;]*?avatar_{folder}_(\w+)\(", header)
        assert len(declared) > 18
        own = [
            name for name in declared if f"VERB({name})(" not in table and f"avatar_gles_{name}(" not in table
        ]
        assert own == (["compiler"] if folder == "d3d11" else [])


def test_frames_allocate_nothing_and_a_lost_context_is_restored(scene: Played) -> None:
    assert scene.of("allocations") == [["0"]]
    # Of memory, in 50 frames: what is lost each frame takes at least 50.
    assert int(scene.of("pages")[0][0]) < 50
    (lost,) = scene.of("lost")
    assert lost[0] == "0" and lost[-1].endswith("_restore")
    np.testing.assert_array_equal(scene.job.image("restored"), scene.job.image("both"))


def test_the_target_is_what_the_device_can_blend(scene: Played) -> None:
    which = [line[0] for line in scene.of("which")]
    assert which in ([], ["0", "1", "1", "2"])
    assert not which or [line[1] for line in scene.of("target")][-4:] == ["1", "0", "0", "0"]


ODD = ((1, 1), (4097, 3), (3, 4097), (17, 5))  # width, height


@pytest.mark.parametrize("kind", KINDS)
def test_images_of_odd_sizes_and_of_nothing(
    kind: str, cases: Mapping[str, PlayedCase], tmp_path: Path
) -> None:
    """Each image is that of the same camera by backend `gl`; what nothing is seen in is empty."""
    case, job = cases[TWO[0]], Job(tmp_path)
    pose, eye = gl_cases.pose_of(case.avatar), (np.zeros(3), 0.7, 0.3, 0.1, 0.7)
    seen = [Camera.orbit(*eye, *size) for size in ODD]
    away = Camera.orbit(np.array([0.0, 0.0, -9.0]), 3.0, 0.0, 0.0, 0.7, 64, 48)  # the avatar is behind it
    job.say("begin", kind)
    job.camera(away)
    job.draw("no_instance")
    job.add(case.folder / HEAD, case.avatar, pose)
    for number, camera in enumerate(seen):
        job.camera(camera)
        job.draw(f"odd_{number}")
    job.camera(away)
    job.draw("behind")
    job.say("show", 0, 0)
    job.draw("hidden")
    job.say("end")
    assert ["left", "0"] in job.run(desk_program(kind))
    for name in ("no_instance", "behind", "hidden"):
        assert not job.image(name).any()
    found = [job.image(f"odd_{number}") for number in range(len(ODD))]
    for image, camera in zip(found, seen, strict=True):
        want = frame_of(case.avatar, pose, camera).image
        assert float(np.abs(image - want).max()) <= IMAGE_LIMIT
    assert found[1][..., 3].max() > 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_a_level_that_is_set_is_played(kind: str, tmp_path: Path) -> None:
    full = gl_cases.avatars()["full"]
    pack, pose, job = tmp_path / HEAD, gl_cases.pose_of(full), Job(tmp_path)
    pack.write_bytes(write(prepare(levels_of(full), COARSE)).file)
    job.say("begin", kind)
    job.camera(gl_cases.camera())
    job.add(pack, full, pose)
    for level in (0, 1, 0):
        job.say("level", 0, level)
        job.draw(f"level_{len(job.lines)}")
    job.say("end")
    assert ["left", "0"] in job.run(desk_program(kind))
    first, second, third = (job.image(name) for name in job.sizes)
    np.testing.assert_array_equal(third, first)
    want = frame_of(decode_pack(pack.read_bytes(), HEAD).avatar, pose, gl_cases.camera(), level=1)
    assert float(np.abs(second - first).max()) > 0.1 and off(second, want.image, IMAGE_LIMIT) <= 1
