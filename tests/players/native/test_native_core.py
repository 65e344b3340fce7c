"""The core of the native player with sanitizers, judged by what Python computes."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export import read
from avatar_export.driving.live_link_csv import read_live_link_csv
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.camera import Camera
from avatar_runtime.clips import clip_pose, frame_pose
from avatar_runtime.codec import safetensors
from avatar_runtime.driving.arkit import canonical, rotation_channel
from avatar_runtime.packs import decode_pack
from avatar_runtime.pose import PoseArrays, resolve
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.measured import Measure
from tests.players import core_cases
from tests.players.native import ask
from tests.players.native.machines import Machine
from tests.players.unity_cases import write_contents
from tests.runtime.backends.gl_cases import avatars

Array = np.ndarray[Any, Any]
Records = Mapping[str, bytes]
PARTS = (0.25, 0.5, 0.9)  # of the way between two frames
TRAINED = Path(__file__).parents[3] / "samples" / "trained"
EPSILON = float(np.finfo(np.float32).eps)
# Python rounds skin matrices to float32 before it skins anchors and mixes joints; here everything is float64.
ROUNDINGS = 16 * EPSILON
SMALLEST = float(np.finfo(np.float32).tiny)  # what lies below is 0 where it is flushed
SIZE = ("struct_size", "<u4")
ANGLES = [(name, "<f8", 3) for name in ("head", "left", "right")]
FRAME = np.dtype([SIZE, ("weights", "<f4", 52), *ANGLES], align=True)
SPELLED = (
    "jawOpen,JAW_OPEN,BS_node.jawOpen,ak_01_eyeBlink_L,arkit_browInnerUp_R,cheekPuffLeft,headYaw,left eye pitch,"
    "a|b:mouthSmile-Right,nothing,ak_jawOpen,eyeBlinkL,browInnerUpleft"
)
MATRIX = ("<f4", 16)
CAMERA_PARTS = {
    "cameraFromWorld": MATRIX,
    "clipFromWorld": MATRIX,
    "centre": ("<f4", 3),
    "tanHalfFov": ("<f4", 2),
}
CAMERA = np.dtype([SIZE, *((name, *part) for name, part in CAMERA_PARTS.items()), ("size", "<i4", 2)])


@pytest.fixture(scope="module")
def names(unity_cases: Path) -> list[str]:
    """The packs of the cases."""
    found: list[str] = json.loads((unity_cases / "packs.json").read_text())["packs"]
    return found


def test_packs_hold_what_python_reads(
    machine: Machine, names: list[str], unity_cases: Path, tmp_path: Path
) -> None:
    """Packs of the cases, of the conformance avatars, and of a trained sample, quantised."""
    made = {name: pack([avatar], None).file for name, avatar in avatars().items()}
    made["sample"] = pack([read(TRAINED / "body_splatting")], Fineness(4.0)).file
    write_contents(made, tmp_path)
    folders = [unity_cases / name for name in names] + [tmp_path / name for name in made]
    for folder, found in zip(folders, ask("contents", folders, tmp_path, machine), strict=True):
        check_contents(found, json.loads((folder / "facts.json").read_text()))


def check_contents(found: Records, want: dict[str, Any]) -> None:
    """The contents of one pack, by hash."""
    assert found["error"] == b""
    for name in ("target", "low", "high"):
        assert struct.unpack("<3d", found[name]) == tuple(want[name]), name
    for name, (size, sha) in want["buffers"].items():
        assert struct.unpack("<I", found[f"size/{name}"]) == (size,)
        assert _sha(found[f"buffer/{name}"]) == sha, name
    assert sum(key.startswith("buffer/") for key in found) == len(want["buffers"])
    for at, clip in enumerate(want["clips"]):
        assert found[f"clip/{at}/name"].decode() == clip.pop("name")
        assert {key: _sha(found[f"clip/{at}/{key}"]) for key in clip} == clip
    assert [key for key in found if key.startswith("expression/")] == [
        f"expression/{e[0]}" for e in want["expressions"]
    ]
    for name, _, limits in want["expressions"]:
        assert struct.unpack("<2d", found[f"expression/{name}"]) == tuple(limits)
    aliases = [(name, alias) for name, others, _ in want["expressions"] for alias in others]
    assert {key for key in found if key.startswith("alias/")} == {f"alias/{n}/{a}" for n, a in aliases}
    order = [name for name, *_ in want["expressions"]]
    meant = {alias: name for name, alias in aliases} | {name: name for name in order}
    for name, alias in aliases:
        assert struct.unpack("<i", found[f"alias/{name}/{alias}"]) == (order.index(meant[alias]),), alias
    groups = [found[f"group/{at}"].decode() for at in range(len(want["groups"]))]
    assert groups == [" ".join(map(str, group)) for group in want["groups"]]
    skeleton = want["skeleton"] or {"names": []}
    assert [found[key].decode() for key in found if key.startswith("joint/")] == skeleton["names"]
    for key in ("parents", "restLocal", "inverseBindMatrix"):
        assert not want["skeleton"] or _sha(found[key]) == skeleton[key]


def _sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def test_poses_give_what_python_computes(
    machine: Machine, names: list[str], unity_cases: Path, tmp_path: Path, measured: Measure
) -> None:
    wanted, folders = [], []
    for name in names:
        want = safetensors.decode((unity_cases / name / "poses.safetensors").read_bytes(), name)
        parts = ("expression_weights", "late_weights", "joint_delta", "world_from_avatar")
        count = len(want["pose_floats"])
        given = [want[part].reshape(count, -1).astype(np.float64) for part in parts]
        folders.append(_folder(tmp_path / name, unity_cases / name / "pack.avatar"))
        (folders[-1] / "poses.f64").write_bytes(np.concatenate(given, axis=1).tobytes())
        wanted.append(want)
    for want, found in zip(wanted, ask("poses", folders, tmp_path, machine), strict=True):
        for key in ("pose_floats", "group_matrix", "group_rotation"):
            made = np.frombuffer(found[key], np.float32).reshape(want[key].shape)
            rows = want[key].reshape(len(made), -1)
            limit = ROUNDINGS * np.maximum(1, np.abs(rows).max(1, initial=0))
            share = float((np.abs(made.reshape(rows.shape) - rows).max(1, initial=0) / limit).max(initial=0))
            measured(f"native core ({machine.name}), poses, share of 16 roundings", share, 1)
            assert share <= 1, key


def _folder(path: Path, pack: Path) -> Path:
    path.mkdir()
    (path / "pack.avatar").symlink_to(pack.resolve())
    return path


def test_driving_and_joints_repeat_the_reference(
    machine: Machine, names: list[str], unity_cases: Path, tmp_path: Path, measured: Measure
) -> None:
    drivable = [name for name in names if name != "surface_without_rig"]
    said = ask("conform", [unity_cases / name for name in drivable], tmp_path, machine)
    for name, found in zip(drivable, said, strict=True):
        assert found["error"] == b"", name
        failed = {key: struct.unpack("<2d", row) for key, row in found.items() if key.count("/") >= 2}
        assert found["passed"] == b"\1", (name, {key: row for key, row in failed.items() if row[1] != 1})
        assert {key.split("/")[-2] for key in failed} == {"driving", "joints"}
        for key, (used, _) in failed.items():
            measured(f"native core ({machine.name}), {key.split('/')[-2]}, share of the tolerance", used, 1)


def test_clips_are_sampled_as_python_does(machine: Machine, unity_cases: Path, tmp_path: Path) -> None:
    avatar = decode_pack((unity_cases / "joints" / "pack.avatar").read_bytes(), "joints").avatar
    clip = avatar.clips[0]
    folder = _folder(tmp_path / "joints", unity_cases / "joints" / "pack.avatar")
    frames = np.arange(clip.frames)
    times = np.concatenate([frames / clip.fps, [(1 + part) / clip.fps for part in PARTS], [-1, 1e9, np.nan]])
    (folder / "times.f64").write_bytes(times.tobytes())
    (found,) = ask("clips", [folder], tmp_path, machine)
    made = np.frombuffer(found["sampled"]).reshape(len(times), -1)
    for frame in frames:
        want = _flat(resolve(frame_pose(avatar, clip, int(frame)), avatar))
        np.testing.assert_array_equal(made[frame], want)
    np.testing.assert_array_equal(made[-3], made[0])
    np.testing.assert_array_equal(made[-2], made[clip.frames - 1])
    np.testing.assert_array_equal(made[-1], made[0])
    for row, part in zip(made[clip.frames :], PARTS, strict=False):
        want = _flat(resolve(clip_pose(avatar, clip, (1 + part) / clip.fps), avatar))
        np.testing.assert_allclose(row, want, rtol=0, atol=16 * EPSILON)
    assert b"there is no clip 99; the last one is clip 1" in found["no clip"]


def _flat(arrays: PoseArrays) -> Array:
    parts = (arrays.expression_weights, arrays.late_weights, arrays.joint_delta, arrays.world_from_avatar)
    return np.concatenate([np.asarray(part, np.float64).ravel() for part in parts])


def test_cameras_have_the_matrices_of_python(machine: Machine, unity_cases: Path, tmp_path: Path) -> None:
    told = json.loads((unity_cases / "cameras.json").read_text())
    order = ("orbit", "fromOpencv")
    for how, file in zip(order, ("orbit", "opencv"), strict=True):
        given = [np.hstack([np.ravel(x) for x in row["given"]]) for row in told if row["how"] == how]
        (tmp_path / f"{file}.f64").write_bytes(np.array(given, np.float64).tobytes())
    rng = np.random.default_rng(4)
    engines = [_engine_camera(rng) for _ in range(20)]
    rows = [[*view.ravel(), *projection.ravel(), *size] for view, projection, size in engines]
    (tmp_path / "opengl.f64").write_bytes(np.array(rows, np.float64).tobytes())
    (found,) = ask("cameras", [tmp_path], tmp_path, machine)
    made = np.frombuffer(found["cameras"], CAMERA)
    seen = [Camera.from_opengl(view, projection, *size) for view, projection, size in engines]
    wanted = [row for how in order for row in told if row["how"] == how]
    wanted += [core_cases.camera_arrays(camera) for camera in seen]
    assert len(made) == len(wanted)
    for have, want in zip(made, wanted, strict=True):
        for key in CAMERA_PARTS:
            limit = 4 * EPSILON * max(1, np.abs(want[key]).max())
            np.testing.assert_allclose(have[key], want[key], rtol=0, atol=limit)


def _engine_camera(rng: np.random.Generator) -> tuple[Array, Array, tuple[int, int]]:
    """A view and a projection of OpenGL, or of an engine whose cameras look along +z; off the middle, any size."""
    towards, size = rng.choice([-1, 1]), rng.uniform(0.5, 3)
    view = homogeneous(matrix_from_rotvec(rng.normal(size=3)), rng.normal(size=3)) * rng.uniform(0.5, 2)
    x, y = rng.uniform(0.5, 4, 2)
    off_x, off_y = rng.normal(0, 0.2, 2)
    projection = size * np.array([[x, 0, off_x, 0], [0, y, off_y, 0], [0, 0, 1.1, -0.2], [0, 0, towards, 0]])
    return view, projection, (int(rng.integers(1, 3000)), int(rng.integers(1, 3000)))


def test_recordings_and_packets_are_read_as_python_reads_them(
    machine: Machine, unity_cases: Path, tmp_path: Path
) -> None:
    csv = (unity_cases / "recording.csv").read_bytes()
    take = read_live_link_csv(csv, "take")
    times = np.concatenate([take.time, (take.time[1:] + take.time[:-1]) / 2, [-1, 1e9, np.nan]])
    for name in ("recording.csv", "packets.bin"):
        (tmp_path / name).symlink_to((unity_cases / name).resolve())
    (tmp_path / "take_times.f64").write_bytes(times.tobytes())
    (found,) = ask("recordings", [tmp_path], tmp_path, machine)
    assert found["error"] == b""
    np.testing.assert_array_equal(np.frombuffer(found["times"]), take.time)
    np.testing.assert_array_equal(np.frombuffer(found["channels"]).reshape(-1, 61), take.channels)
    assert struct.unpack("<d", found["fps"]) == (take.fps,)
    frames = _channels(np.frombuffer(found["frames"], FRAME))
    count = len(take.time)
    want = np.concatenate([take.channels, (take.channels[1:] + take.channels[:-1]) / 2])
    np.testing.assert_allclose(frames[: len(want)], want, rtol=0, atol=4 * EPSILON * np.abs(want).max())
    np.testing.assert_array_equal(frames[-3:], frames[[0, count - 1, 0]])
    _check_packets((unity_cases / "packets.bin").read_bytes(), found)


def _channels(frames: Array) -> Array:
    parts = [frames[name].astype(np.float64) for name in ("weights", "head", "left", "right")]
    return np.concatenate(parts, axis=1)


def _check_packets(data: bytes, found: Records) -> None:
    faces = _channels(np.frombuffer(found["faces"], FRAME))
    at = count = taken = 0
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        at += 4 + length
        assert found["taken"][count] == data[at], f"packet {count}"
        want = np.frombuffer(data, "<f8", 61, at + 1) if data[at] else np.zeros(61)
        np.testing.assert_allclose(faces[count], want, rtol=0, atol=SMALLEST)
        taken += data[at]
        at += 1 + 8 * 61 * data[at]
        count += 1
    assert count > 1000 and taken > 50


def test_spellings_of_channels_are_understood(machine: Machine, tmp_path: Path) -> None:
    spelled = SPELLED.split(",")
    (tmp_path / "names.txt").write_text("".join(f"{name}\n" for name in spelled))
    (found,) = ask("spellings", [tmp_path], tmp_path, machine)
    for name in spelled:
        assert found[name].decode() == (canonical(name) or rotation_channel(name) or ""), name
