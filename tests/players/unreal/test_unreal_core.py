"""What the Unreal plugin decides without the engine: frames, cameras, levels, layers of a pose, dispatches of a view.

Oracles write Unreal's conventions as matrices of their own: left-handed, +X forward, +Y right, +Z up, centimetres.
FMatrix is for row vectors. A view has x right, y up, z forward; its projection has depth 1 at the near plane.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from avatar_export.packing.write import prepare, write
from avatar_runtime.avatar import F32, F64
from avatar_runtime.camera import Camera
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.handedness import mirrored
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import matrix_from_rotvec
from tests.avatars import full_avatar
from tests.players.unreal.core import (
    CLEAR,
    EXPRESSION,
    EYELID,
    JOINT,
    KEYS,
    SCRIPT,
    Core,
    Face,
    Stage,
    stage,
)
from tests.players.unreal.sources import library

SIZE = (96, 80)
NEAR_CM = 10.0
BORDER_PX = 40.0  # up to which the coarser level is meant
ROUNDING = 2.0**-24
IMAGE_LIMIT = 1024 * ROUNDING  # place and camera are rounded apart, then their products meet exp
# Unreal's axes of a pack's: the face, +Z, looks along +X; +Y is up, +Z; of a left-handed pack +X is to the right, +Y.
UNREAL_FROM_LEFT = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float)
UNREAL_FROM_RIGHT = UNREAL_FROM_LEFT @ np.diag([-1.0, 1, 1])
# Right, up, forward of a camera that looks along +X.
VIEW_AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], float)
FAR_AWAY = np.array([6.1e6 + 0.3, -2.3e6 - 0.7, 4.4e5 + 0.1])  # centimetres: float32 is off by half of one


def affine(linear: F64, offset: F64) -> F64:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = linear, offset
    return made


def pinhole(width: int, height: int, tangent: float = 0.35) -> F64:
    """An FMatrix."""
    rows = np.zeros((4, 4))
    rows[0, 0], rows[1, 1] = 1 / tangent, width / height / tangent
    rows[2, 3], rows[3, 2] = 1, NEAR_CM
    return rows


def seen(turn: F64) -> F64:
    """The view rotation of a camera that was turned from looking along +X, as FMatrix."""
    return affine(VIEW_AXES @ turn.T, np.zeros(3)).T


def quaternion(vector: F64) -> F64:
    """FQuat of a rotation vector: x, y, z, w."""
    angle = float(np.linalg.norm(vector))
    return np.array([*(vector / angle * np.sin(angle / 2) if angle else vector), np.cos(angle / 2)])


def component(at: F64, turn: F64, scale: float = 1.0) -> F64:
    """The FMatrix of a component."""
    return affine(scale * turn, at).T


TURN = quaternion(np.array([0.1, 0.2, 0.3]))


@pytest.fixture(scope="module")
def core() -> Core:
    return Core(library())


@pytest.fixture(scope="module")
def packs() -> dict[str, bytes]:
    """One avatar in both frames, with two levels."""
    full = full_avatar(3)
    both = {"right": full, "left": mirrored(full)}
    facts = {"levels": [{"height_px": None}, {"height_px": BORDER_PX}]}
    return {name: write(prepare([one, one], None), facts, None, name).file for name, one in both.items()}


@pytest.fixture(scope="module")
def scene(core: Core) -> Iterator[Stage]:
    with stage(core) as made:
        yield made


@pytest.fixture
def right(scene: Stage, packs: dict[str, bytes]) -> Iterator[Stage]:
    """The scene with the right-handed avatar as number 1."""
    assert scene.add(1, packs["right"]) is None
    yield scene
    scene.remove(1)


@pytest.fixture
def left(scene: Stage, packs: dict[str, bytes]) -> Iterator[Stage]:
    """The same of the left-handed one, which stands at the origin."""
    assert scene.add(1, packs["left"]) is None
    scene.mix(1)
    scene.send(1, np.eye(4))
    yield scene
    scene.remove(1)
    assert scene.released[-1] == 1


def shot(scene: Stage, frame: int, distance: float = 60.0) -> F32 | None:
    """The image of a camera before the origin that looks along +X."""
    return scene.draw(seen(np.eye(3)), pinhole(*SIZE), np.array([-distance, 0, 0]), SIZE, frame)


def test_places_and_boxes_have_unreals_axes_and_the_scenes_metres(core: Core) -> None:
    rng = np.random.default_rng(1)
    turn = matrix_from_rotvec(rng.normal(size=3))
    eye = FAR_AWAY + np.array([30.2, -150.1, 20.3])
    placed = core.place(component(FAR_AWAY, turn, 1.7), eye)
    point = rng.normal(size=3)
    want = (1.7 * turn @ (100 * UNREAL_FROM_RIGHT @ point) + FAR_AWAY - eye) / 100
    np.testing.assert_allclose(placed @ [*point, 1], [*want, 1], rtol=0, atol=1e-8)  # 1e6 cm in doubles
    low, high = np.sort(rng.normal(size=(2, 3)), axis=0)
    corners = 100 * UNREAL_FROM_RIGHT @ np.stack([low, high], axis=1)
    np.testing.assert_allclose(core.box(low, high), [corners.min(1), corners.max(1)], rtol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.8, np.pi, 5.0])  # 5 is the same as 5 - 2 pi
def test_a_joint_turns_as_unreal_says(core: Core, angle: float) -> None:
    """A rotation about Unreal's axes moves a point of the person where Unreal's matrix moves it."""
    point, vector = UNREAL_FROM_RIGHT @ np.array([0.1, 0.4, -0.5]), angle * np.array([0.36, -0.8, 0.48])
    for sign in (1, -1):  # one rotation has two quaternions
        found = core.rotation(sign * quaternion(vector))
        turned = UNREAL_FROM_RIGHT @ matrix_from_rotvec(found) @ UNREAL_FROM_RIGHT.T
        np.testing.assert_allclose(turned @ point, matrix_from_rotvec(vector) @ point, atol=1e-14)
        assert np.linalg.norm(found) < 3.2


def test_a_camera_sees_what_the_view_sees(core: Core) -> None:
    turn, projection = matrix_from_rotvec(np.array([0.1, -0.4, 0.9])), pinhole(*SIZE)
    camera = core.camera(seen(turn), projection, *SIZE)
    assert camera is not None and (camera.width, camera.height) == SIZE
    point = np.array([0.2, 0.1, -0.3]) + 2 * turn[:, 0]  # metres from the eye, before it
    clip = np.array([*(100 * point), 1]) @ seen(turn) @ projection
    x, y, depth = clip[:3] / clip[3]
    ours = np.array(camera.clip_from_world).reshape(4, 4).astype(float) @ [*point, 1]
    np.testing.assert_allclose(ours[:3] / ours[3], [x, -y, depth], rtol=0, atol=8 * ROUNDING)
    np.testing.assert_allclose(ours[3], point @ turn[:, 0], rtol=8 * ROUNDING)
    view = np.array(camera.camera_from_world).reshape(4, 4) @ [*point, 1]
    across, up, forward = VIEW_AXES @ turn.T @ point
    np.testing.assert_allclose(view, [across, -up, forward, 1], rtol=0, atol=8 * ROUNDING)
    np.testing.assert_allclose(camera.tan_half_fov, [0.35, 0.35 * SIZE[1] / SIZE[0]], rtol=2 * ROUNDING)
    orthographic = np.diag([0.01, 0.01, 0.001, 1])
    assert core.camera(np.eye(4), orthographic, *SIZE) is None
    assert core.camera(np.eye(4), projection, 0, 80) is None


def test_levels_change_beyond_a_tenth_of_their_border(left: Stage, packs: dict[str, bytes]) -> None:
    """The height of the framing's box before the camera decides, from the second frame on."""
    rest = decode_pack(packs["left"], "left").document["avatar"]["bounds"]["rest"]
    low, high = np.array(rest["min"]), np.array(rest["max"])
    tall, depth = 1.08 * (high - low)[1], (low + high)[2] / 2  # without a stated framing: the box at rest
    focal = SIZE[0] / (2 * 0.35)
    changed = []
    for frame, share in enumerate((1.05, 1.05, 1.05, 0.95, 0.95, 0.8, 0.8, 1.05, 1.05, 1.2, 1.2)):
        shot(left, frame + 1, 100 * (focal * tall / (share * BORDER_PX) - depth))
        changed.append("blend" in left.runs)
    # Coarsest; the finest as none was chosen; it stays at 0.95; a frame after 0.8 the coarser; that stays at 1.05.
    assert changed == [True, True, False, False, False, False, True, False, False, False, True]


def test_layers_replace_single_values(right: Stage, packs: dict[str, bytes]) -> None:
    avatar = decode_pack(packs["right"], "right").avatar
    assert right.mix(1, 0, 0.0) is None
    weights, eyelids, joints, root = right.pose(1)
    np.testing.assert_array_equal(weights, avatar.clips[0].expression_weights[0])
    np.testing.assert_array_equal(root, avatar.clips[0].world_from_avatar[0])
    for source, kind, name, value in (
        (KEYS, EXPRESSION, "jawOpen", (0.25,)),
        (KEYS, EYELID, "left", (0.75,)),
        (SCRIPT, EXPRESSION, "mouthSmile_L", (0.5,)),  # by another name
        (KEYS, JOINT, "jaw", TURN),
    ):
        assert right.set(1, source, kind, name, value) is None
    assert right.mix(1, 0, 0.0) is None
    mixed = right.pose(1)
    np.testing.assert_array_equal(mixed[0], [0.25, 0.5, *weights[2:]])
    np.testing.assert_array_equal(mixed[1], [0.75, eyelids[1]])
    other = [j for j, name in enumerate(avatar.rig.joint_names) if name != "jaw"]
    np.testing.assert_array_equal(mixed[2][other], joints[other])
    assert np.abs(mixed[2] - joints).max() > 0.05
    assert right.set(1, SCRIPT, EXPRESSION, "jawOpen", (0.5,)) is None  # scripts lie over keys
    right.mix(1, 0, 0.0)
    assert right.pose(1)[0][0] == 0.5
    for source in (KEYS, SCRIPT):
        right.set(1, source, CLEAR)
    right.mix(1, 0, 0.0)
    np.testing.assert_array_equal(right.pose(1)[0], weights)


def test_a_live_face_wins_where_the_file_maps_it(core: Core, right: Stage, packs: dict[str, bytes]) -> None:
    """It lies over scripts, keys and the clip, as in Unity; what the driving does not name stays theirs."""
    avatar = decode_pack(packs["right"], "right").avatar
    assert avatar.rig is not None
    face = Face()
    given = (("JawOpen", 0.75, 1), ("HeadYaw", 0.2, 1), ("LeftEyePitch", 0.3, 1), ("Smoothness", 1, 0))
    for name, value, known in given:
        assert core.c.channel(ctypes.byref(face), name.encode(), ctypes.c_double(value)) == known
    assert (face.weights[17], face.head[0], face.left_eye[1]) == (0.75, np.float64(0.2), 0.3)
    for kind, names, value in (
        (EXPRESSION, ("jawOpen",), (0.125,)),
        (EYELID, ("left", "right"), (0.125,)),
        (JOINT, ("jaw", "root"), TURN),
    ):
        for name in names:
            assert right.set(1, SCRIPT, kind, name, value) is None
    right.mix(1, 0, 0.5)
    without = right.pose(1)
    assert right.mix(1, 0, 0.5, face) is None
    found = right.pose(1)
    frame = DrivingFrame(0.0, {"jawOpen": 0.75}, head=(0.2, 0, 0), left_eye=(0, 0.3, 0))
    wanted = Driver(avatar, within_range=True).pose(frame)
    known_names = avatar.expression_names, avatar.eyelids, avatar.rig.joint_names
    parts = wanted.expressions, wanted.eyelids, wanted.joints
    mapped = {"jawOpen", "exp_003"}, {"left"}, {"jaw", "leftEye", "rightEye", "neck"}
    for part, own in enumerate(known_names):
        assert set(parts[part]) == mapped[part]
        want = [parts[part].get(name, without[part][at]) for at, name in enumerate(own)]
        np.testing.assert_allclose(found[part], want, rtol=0, atol=4 * ROUNDING)
    np.testing.assert_array_equal(found[3], without[3])  # a joint has the head's rotation
    assert found[0][0] != 0.125 and found[1][1] == 0.125 and np.abs(found[2] - without[2]).max() > 0.05


def test_a_face_moves_the_whole_where_no_joint_is_the_head(core: Core, scene: Stage) -> None:
    full = full_avatar(3)
    headless = replace(full, driving=replace(full.driving, head_joint=None))
    file = write(prepare([headless], None), {}, None, "right").file
    assert scene.add(1, file) is None
    face = Face()
    core.c.channel(ctypes.byref(face), b"headYaw", ctypes.c_double(0.25))
    assert scene.mix(1, 0, 0.5, face) is None
    wanted = Driver(decode_pack(file, "headless").avatar).pose(DrivingFrame(0.0, {}, head=(0.25, 0, 0)))
    np.testing.assert_allclose(scene.pose(1)[3], wanted.world_from_avatar, atol=1e-12)
    assert "neck" not in wanted.joints and np.abs(wanted.world_from_avatar - np.eye(4)).max() > 0.2
    scene.remove(1)


def test_names_are_found_in_any_case(right: Stage, packs: dict[str, bytes]) -> None:
    """A packaged game may spell a name as whoever used it first: Live Link, say."""
    for kind, name, value in (
        (EXPRESSION, "JAWOPEN", (0.25,)),
        (EXPRESSION, "MouthSmileRight", (0.5,)),
        (EXPRESSION, "mouthsmile_l", (1.0,)),
        (EYELID, "LEFT", (0.75,)),
        (JOINT, "JAW", (0.6, 0, 0, 0.8)),
    ):
        assert right.set(1, SCRIPT, kind, name, value) is None, name
    right.mix(1)
    weights, eyelids, joints, _ = right.pose(1)
    np.testing.assert_array_equal(weights[:3], [0.25, 1.0, 0.5])
    assert eyelids[0] == 0.75 and not np.array_equal(joints[2], np.eye(4))
    assert right.clip(1, "NOD") == right.clip(1, "nod") == (0, pytest.approx(4 / 24))
    assert right.clip(1, "sneeze") == (-1, 0)
    avatar = decode_pack(packs["right"], "right").avatar
    assert avatar.rig is not None
    names = (avatar.expression_names, avatar.eyelids, avatar.rig.joint_names, ["nod", "blink"])
    assert right.names(1) == [name for part in names for name in part]


def test_mistakes_are_one_line(right: Stage, packs: dict[str, bytes]) -> None:
    cut = right.add(2, packs["right"][:500], "cut.avatar")
    assert cut is not None and cut.startswith("cut.avatar") and "\n" not in cut
    lines = []
    for kind, name, like in (
        (EXPRESSION, "jawOpn", "jawOpen"),
        (EYELID, "leftt", "left"),
        (JOINT, "nose", ""),
    ):
        line = right.set(1, SCRIPT, kind, name, (0, 0, 0, 1))
        assert line is not None and name in line and like in line
        assert right.set(1, KEYS, kind, name, (0, 0, 0, 1)) == line
        assert right.news(1) == line and right.news(1) is None  # each line is told once
        lines.append(line)
    right.set(1, SCRIPT, EXPRESSION, "jawOpn", (1.0,))
    assert right.news(1) is None and len(set(lines)) == 3


def picture(avatar: bytes, camera_from_avatar: F64, size: tuple[int, int]) -> F32:
    """[H, W, 4] at rest by backend `gl`, whose world is the avatar."""
    decoded = decode_pack(avatar, "pack").avatar
    fx = size[0] / (2 * 0.35)
    k = np.array([[2 * fx / size[0], 0, 0, 0], [0, 2 * fx / size[1], 0, 0], [0, 0, 1, -0.01], [0, 0, 1, 0]])
    centre = -np.linalg.inv(camera_from_avatar[:3, :3]) @ camera_from_avatar[:3, 3]
    tangents = 0.35, 0.35 * size[1] / size[0]
    camera = Camera(camera_from_avatar, k @ camera_from_avatar, centre, *tangents, *size)
    image = Player(decoded, "gl", level=0, target="rgba32f").frame(Pose(), camera, (0.0, 0.0, 0.0)).image
    return np.dstack([image.colour, 1 - image.transmittance])


def test_views_show_what_backend_gl_draws(scene: Stage, packs: dict[str, bytes]) -> None:
    """Both frames, far from the level's origin, turned and scaled."""
    turn = matrix_from_rotvec(np.array([0.2, -0.1, 0.4]))
    look = matrix_from_rotvec(np.array([0.05, 0.1, np.pi]))
    eye = FAR_AWAY - 90 * look[:, 0]
    images = []
    for name, axes in (("left", UNREAL_FROM_LEFT), ("right", UNREAL_FROM_RIGHT)):
        assert scene.add(7, packs[name]) is None
        scene.mix(7)
        scene.send(7, component(FAR_AWAY, turn, 1.5))
        for frame in (1, 2):  # the first is of the coarsest level
            got = scene.draw(seen(look), pinhole(*SIZE), eye, SIZE, frame)
        view = affine(np.diag([1.0, -1, 1]) @ VIEW_AXES @ look.T, np.zeros(3)) @ affine(np.eye(3), -eye)
        avatar_to_world = affine(100 * 1.5 * turn @ axes, FAR_AWAY)
        want = picture(packs[name], np.diag([0.01, 0.01, 0.01, 1]) @ view @ avatar_to_world, SIZE)
        assert got is not None and want[..., 3].max() > 0.5 and scene.error() is None
        assert np.abs(got - want).max() <= IMAGE_LIMIT
        images.append(got)
        scene.remove(7)
    assert np.abs(images[0] - images[1]).max() <= IMAGE_LIMIT


def test_only_what_changed_is_run(left: Stage) -> None:
    for frame in (1, 2):
        shot(left, frame)
    assert "blend" in left.runs
    shot(left, 2)  # the other eye
    assert "blend" not in left.runs and left.runs.count("project") >= 1
    left.send(1, np.eye(4))
    shot(left, 3)
    assert "blend" in left.runs
    left.send(1, np.eye(4), shown=False)
    assert shot(left, 4) is None and not left.runs


def test_viewports_of_one_frame_share_a_level(left: Stage) -> None:
    """A near and a far one: the near one decides, and nothing is deformed again from one to the other."""
    for frame in (1, 2, 3, 4):
        deformed = []
        for distance in (60.0, 4000.0):
            assert shot(left, frame, distance) is not None
            deformed.append("blend" in left.runs)
        assert deformed == [frame < 3, False]  # the coarsest level, then the finest; then both stay
    for frame in (5, 6):
        shot(left, frame, 4000.0)
    assert "blend" in left.runs  # nobody is near any more


def test_two_avatars_are_sorted_together(scene: Stage, packs: dict[str, bytes]) -> None:
    """Through each other, they differ from one drawn over the other, whichever is added first."""
    shots = []
    for order in ((1, 2), (2, 1)):
        for number, shift in zip(order, (0.0, 1.0), strict=True):
            assert scene.add(number, packs["left"]) is None
            scene.mix(number)
            scene.send(number, component(np.array([shift, 2 * shift, 0]), np.eye(3)))
        shots.append([shot(scene, frame + 10 * order[0]) for frame in (1, 2)][-1])
        for number in (1, 2):
            scene.remove(number)
    assert shots[0] is not None and shots[1] is not None
    np.testing.assert_array_equal(shots[0], shots[1])
