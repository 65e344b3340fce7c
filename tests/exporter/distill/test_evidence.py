"""What dumps show of themselves: units, the order of quaternions, shifted rows, joints that never moved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.distill.untaught import held
from samples.dumps import random_poses, write_dumps

from avatar_export.distill.dumps.folder import Encoding
from avatar_export.distill.prepare import Prepared, prepared
from avatar_export.distill.report import report_html
from avatar_export.notes.text import text
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.pose import Pose
from avatar_runtime.subset import subset
from tests.commands import Run
from tests.exporter.distill.conftest import TRAINED, copied, edited, with_arrays
from tests.exporter.refusals import refused

NO_JOINTS = {"joint_names": np.zeros(0, "U1"), "parents": np.zeros(0, np.int64), "rest": np.zeros((0, 4, 4))}


def stored(folder: Path) -> Mapping[str, Any]:
    """The arrays of drivers.npz."""
    with np.load(folder / "drivers.npz") as arrays:
        return dict(arrays)


def without_joints(folder: Path) -> Path:
    """`folder` without a skeleton."""
    frames = len(stored(folder)["take"])
    return with_arrays(folder, **NO_JOINTS, world_from_joint=np.zeros((frames, 0, 4, 4)))


def kinds(found: Prepared) -> list[str]:
    """What is mended and what is doubtful."""
    return [note.kind for note in (*found.checked.mended, *found.doubts)]


@pytest.mark.parametrize("name", ["head_blendshapes", "head_splatting", "head_points", "body_splatting"])
@pytest.mark.parametrize("skeleton", [True, False])
def test_sound_dumps_give_no_alarm(name: str, skeleton: bool, tmp_path: Path) -> None:
    whole = load(TRAINED / name)
    avatar = subset(whole, np.arange(0, whole.gaussians.count, 20), np.arange(len(whole.rig.vertices))).avatar
    takes = [random_poses(avatar, 120, 8.0), random_poses(avatar, 8, 8.0, seed=8)]
    assert kinds(prepared(write_dumps(avatar, takes, tmp_path / "dumps", skeleton=skeleton))) == []


@pytest.mark.parametrize(
    "case, changes",
    [("skeleton", {}), ("alone", {}), ("still", {}), ("skeleton", {"up_axis": "+z"}), ("stated", {})],
)
def test_the_other_order_of_quaternions_is_found(
    case: str, changes: dict[str, Any], head_dumps: Path, small_head: Avatar, tmp_path: Path
) -> None:
    folder = tmp_path / "dumps"
    if case in ("still", "stated"):
        poses = [[Pose()] * 6] if case == "still" else [random_poses(small_head, 12, 8.0)]
        write_dumps(small_head, poses, folder, Encoding(quaternion="xyzw"))
        wanted, said = "xyzw", "wxyz"
    else:
        copied(head_dumps, folder)
        wanted, said = "wxyz", "xyzw"
    folder = without_joints(folder) if case == "alone" else folder
    found = prepared(edited(folder, encoding__quaternion=said, **changes))
    assert [note.kind for note in found.checked.mended] == ["quaternion_order"]
    assert found.task.dumps.encoding.quaternion == wanted and found.task.turns


def test_quaternions_that_surface_and_rest_do_not_agree_on_are_doubtful(
    small_head: Avatar, tmp_path: Path
) -> None:
    folder = write_dumps(small_head, [[Pose()] * 6], tmp_path / "dumps", skeleton=False)
    assert "quaternion_doubt" not in kinds(prepared(folder))
    for frame in sorted((folder / "frames").iterdir()):  # round Gaussians, and w the last
        frame.write_bytes(_rounded(frame.read_bytes(), small_head.gaussians.count))
    assert "quaternion_doubt" in kinds(prepared(folder))


def _rounded(data: bytes, count: int) -> bytes:
    head = data.index(b"end_header\n") + len(b"end_header\n")
    names = [line.split()[-1].decode() for line in data[:head].splitlines() if line.startswith(b"property")]
    rows = np.frombuffer(data, "<f4", offset=head).reshape(count, -1).copy()
    rows[:, [names.index(f"scale_{k}") for k in range(3)]] = -6.0
    rows[:, [names.index(f"rot_{k}") for k in range(4)]] = [0.1, 0.0, 0.0, 1.0]
    return data[:head] + rows.tobytes()


@pytest.mark.parametrize("name", ["drivers and joints", "drivers", "joints"])
@pytest.mark.parametrize("shift", [5, -2])
def test_rows_that_are_some_frames_off_are_named(
    name: str, shift: int, head_dumps: Path, tmp_path: Path
) -> None:
    folder, arrays = copied(head_dumps, tmp_path / "dumps"), stored(head_dumps)
    off = {"drivers and joints": ("drivers", "world_from_joint"), "drivers": ("drivers",)}
    first = np.flatnonzero(arrays["take"] == 0)
    for array in off.get(name, ("world_from_joint",)):
        arrays[array][first] = np.roll(arrays[array][first], shift, axis=0)
    (note,) = prepared(with_arrays(folder, **arrays)).doubts
    assert (note.kind, note.values["which"], note.values["shift"]) == ("shifted", name, shift)
    assert f"{abs(shift)} {'later' if shift > 0 else 'earlier'}" in text(note) and "take_0" in text(note)


@pytest.mark.parametrize("factor", [1000.0, 0.01, 4.0, 0.25])
def test_units(factor: float, head_dumps: Path, body_dumps: Path, tmp_path: Path) -> None:
    for folder, unit in ((head_dumps, 1.0), (body_dumps, 1.0)):
        own, arrays = copied(folder, tmp_path / folder.name), stored(folder)
        found = prepared(edited(own, unit=unit * factor)).doubts
        sizes = [note for note in found if note.kind == "not_human"]
        if factor in (1000.0, 0.01) or folder is head_dumps:  # 0.37 m is a head, 5.7 m may be in feet
            assert sizes[0].values["right"] == pytest.approx(unit), text(sizes[0])
        for name in ("rest", "world_from_joint"):
            arrays[name][..., :3, 3] *= factor
        said = rf"drivers.npz: has not the unit of the frames: times {1 / factor:.4g}, "
        refused(said, prepared, with_arrays(edited(own, unit=unit), **arrays))


@pytest.mark.parametrize("case", ["head", "body", "body with its mesh"])
def test_joints_that_never_moved_carry_nothing(
    case: str, small_head: Avatar, small_body: Avatar, tmp_path: Path
) -> None:
    """The knee and the neck have children that moved; both stand turned in the dumps."""
    head, mesh = case == "head", case == "body with its mesh"
    joints = ("neck", "rightEye") if head else ("Skeleton_arm_joint_L__2_", "leg_joint_R_2")
    found = held(
        small_head if head else small_body,
        joints,
        tmp_path / "dumps",
        40,
        with_rig=mesh,
        degrees=0.0 if mesh else 30.0,
    )
    print(f"{case}: torn {found.alone} alone, {found.mixed} mixed, {found.taught:.3f} mm")
    (note,) = [note for note in found.result.doubts if note.kind == "untaught"]
    assert set(note.values["joints"]) == set(joints) and note.values["by_rig"] == mesh
    assert f"against their parents: {', '.join(note.values['joints'])}." in report_html(found.result)
    assert found.alone[1] <= found.alone[0] + 1e-6 and found.mixed[1] <= found.mixed[0] + 1e-6
    assert (found.alone[1] > 0) == mesh and found.taught < 5


def test_check_gives_a_verdict(head_dumps: Path, few: Path, tmp_path: Path, run: Run) -> None:
    for folder, code, verdict in (
        (head_dumps, 0, "the dumps are fit for distill\n"),
        (edited(copied(head_dumps, tmp_path / "a"), encoding__quaternion="xyzw"), 0, "fit for distill, as mended"),
        (few, 0, "can be distilled, but see to the warnings first"),
        (with_arrays(copied(few, tmp_path / "b"), rest=None), 2, "the dumps are not fit for distill"),
    ):  # fmt: skip
        done = run("check", folder)
        assert done[0] == code and verdict in done[1], done
