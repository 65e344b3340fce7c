"""The poses to dump: what drivers.npz holds, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.distill import drivers
from avatar_export.distill.poses import BODY_RANGE, LEAST_RANDOM, MORPH_RANGE, driven, poses_to_dump
from avatar_runtime.io.errors import AvatarError
from tests.commands import Run
from tests.exporter.bodies import body_files
from tests.exporter.rigs import rig_files
from tests.oracles import lbs

Array = npt.NDArray[Any]

DOUBLE = 1e-12


@pytest.fixture
def flame(tmp_path: Path) -> Path:
    return body_files.write_body(tmp_path / "flame.npz", body_files.body(body_files.FLAME_PARENTS))


def _made(path: Path, count: int | None = None, seed: int = 0, shape: Path | None = None) -> drivers.Drivers:
    return poses_to_dump(driven(path, shape, 15.0), count, seed)


def test_joints_are_those_of_the_body_model(flame: Path, tmp_path: Path) -> None:
    """World transforms against FLAME's chain, joint by joint; the shape and the expressions move the joints."""
    model = body_files.body(body_files.FLAME_PARENTS)
    shape = np.array([1.0, -0.5, 0.3, 0.8])
    np.save(tmp_path / "shape.npy", shape)
    made = _made(flame, shape=tmp_path / "shape.npy")
    turns = drivers.joint_rotations(made)
    for t in (0, 1, 20, made.frames - 1):
        shaped = model["v_template"] + model["identity"] @ shape + model["expression"] @ made.drivers[t]
        places = model["regressor"].astype(np.float64) @ shaped
        world: list[Array] = []
        for j, parent in enumerate(model["parents"]):
            local = np.eye(4)
            local[:3, :3] = turns[t, j]
            local[:3, 3] = places[j] - (places[parent] if parent >= 0 else 0)
            world.append(local if parent < 0 else world[parent] @ local)
        assert np.abs(made.world_from_joint[t] - world).max() < 1e-6  # the rig is float32
    assert made.parents.tolist() == list(body_files.FLAME_PARENTS)
    assert np.abs(turns @ np.swapaxes(turns, -1, -2) - np.eye(3)).max() < DOUBLE


def test_every_driver_and_every_joint_is_seen_alone_at_its_ends(flame: Path) -> None:
    made = _made(flame)
    turns = np.abs(drivers.joint_rotations(made) - np.eye(3)).max(axis=(2, 3)) > 1e-9
    assert made.driver_names == ("exp_000", "exp_001", "exp_002")
    alone = {
        (int(row.nonzero()[0][0]), float(row[row.nonzero()[0][0]]))
        for row, turned in zip(made.drivers, turns, strict=True)
        if np.count_nonzero(row) == 1 and not turned.any()
    }
    assert alone == {(k, end) for k in range(3) for end in BODY_RANGE}
    single = [
        int(np.flatnonzero(turned)[0])
        for turned, row in zip(turns, made.drivers, strict=True)
        if turned.sum() == 1 and not row.any()
    ]
    assert set(single) == {1, 2, 3, 4} and not turns[:, 0].any(), "roots stay"
    assert not turns[0].any() and not made.drivers[0].any(), "the first frame is the rest pose"


def test_ranges_are_kept(flame: Path) -> None:
    made = _made(flame, 500)
    assert (np.abs(made.drivers) <= BODY_RANGE[1]).all()
    rotations = drivers.joint_rotations(made)
    angle = np.degrees(np.arccos(np.clip((np.trace(rotations, axis1=2, axis2=3) - 1) / 2, -1, 1)))
    assert angle[:, 1].max() < 15 * np.sqrt(3) + 1e-6 and angle[:, 1].max() > 15
    jaw = lbs_vectors(rotations[:, 2])
    assert jaw[:, 0].min() > -1e-6 and np.degrees(jaw[:, 0].max()) > 15, (
        "the jaw opens and does not close further"
    )


def lbs_vectors(rotations: Array) -> Array:
    """Rotation vectors of small rotations, by their skew parts."""
    skew = np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(skew, axis=1) / 2
    vectors = skew / 2 * (np.arcsin(sine) / np.maximum(sine, 1e-12))[:, None]
    assert np.abs(np.stack([lbs.rodrigues(v) for v in vectors]) - rotations).max() < 1e-9
    return vectors


def test_random_frames_stand_in_takes_of_their_own(flame: Path) -> None:
    made = _made(flame)
    counts = np.bincount(made.take)
    assert len(counts) == 7 and counts[2:].sum() == LEAST_RANDOM and (np.diff(made.take) >= 0).all()
    assert counts[0] == 1 + 2 * 3
    assert (np.unique(made.take) == np.arange(7)).all()


def test_the_same_seed_gives_the_same_bytes(flame: Path, tmp_path: Path) -> None:
    for name, seed in (("a", 4), ("b", 4), ("c", 5)):
        drivers.write(_made(flame, 20, seed), tmp_path / f"{name}.npz", force=False)
    a, b, c = ((tmp_path / f"{name}.npz").read_bytes() for name in "abc")
    assert a == b != c


def test_a_rig_of_a_glb_has_its_morph_targets(tmp_path: Path) -> None:
    path = tmp_path / "rig.glb"
    path.write_bytes(rig_files.rig_glb())
    made = _made(path, 100)
    assert made.driver_names and made.joint_names
    assert made.drivers.min() == MORPH_RANGE[0] and made.drivers.max() == MORPH_RANGE[1]
    random = made.drivers[made.take > 1]
    assert 0.1 < np.mean(random > 0) < 0.5
    with pytest.raises(AvatarError, match="--shape: goes with a body model"):
        driven(path, path, 15.0)


def test_rotations_are_in_the_rest_frames_of_the_joints() -> None:
    """CesiumMan's joints rest turned: still at rest, then one joint by 15 degrees about one of its axes."""
    made = _made(Path(__file__).parents[3] / "samples" / "data" / "CesiumMan.glb", 5)
    assert np.abs(made.rest[3, :3, :3] - np.eye(3)).max() > 0.1, "a rest frame that is turned"
    vectors = lbs_vectors(drivers.joint_rotations(made)[made.take == 0].reshape(-1, 3, 3)).reshape(-1, 19, 3)
    assert np.abs(vectors[0]).max() < 1e-5
    for vector in vectors[1:]:
        turned = np.abs(vector) > 1e-4
        assert turned.sum() == 1 and abs(abs(vector[turned][0]) - np.radians(15)) < 1e-5


def test_what_is_written_is_read(flame: Path, tmp_path: Path) -> None:
    made, file = _made(flame, 5), tmp_path / "drivers.npz"
    drivers.write(made, file, force=False)
    found = drivers.read(file)
    assert found.joint_names == made.joint_names and found.driver_names == made.driver_names
    for name in ("parents", "rest", "world_from_joint", "drivers", "take"):
        assert np.array_equal(getattr(found, name), getattr(made, name)), name
    with pytest.raises(AvatarError, match="pass --force to replace it"):
        drivers.write(made, file, force=False)


def test_there_may_be_no_drivers(tmp_path: Path) -> None:
    """CesiumMan has no morph targets."""
    made = _made(Path(__file__).parents[3] / "samples" / "data" / "CesiumMan.glb", 5)
    drivers.write(made, tmp_path / "d.npz", force=False)
    found = drivers.read(tmp_path / "d.npz")
    assert found.driver_names == () and found.drivers.shape == (found.frames, 0)
    assert np.unique(found.take).tolist() == list(range(6))


def _spoiled(made: drivers.Drivers, name: str) -> drivers.Drivers:
    world = made.world_from_joint.copy()
    if name == "singular":
        world[3, 1] = np.diag((0.0, 0, 0, 1))
        return replace(made, world_from_joint=world)
    if name == "row":
        world[3, 1, 3] = 1
        return replace(made, world_from_joint=world)
    if name == "nan":
        given = made.drivers.copy()
        given[2, 1] = np.nan
        return replace(made, drivers=given)
    if name == "short":
        return replace(made, drivers=made.drivers[:-1])
    if name == "parents":
        return replace(made, parents=np.array([-1, 0, 3, 1, 1]))
    if name == "empty":
        return replace(made, world_from_joint=world[:0], drivers=made.drivers[:0], take=made.take[:0])
    return replace(made, driver_names=("a", "a", "b"))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("singular", r"world_from_joint: \[3, 1\] is not an affine matrix with an inverse"),
        ("row", r"world_from_joint: \[3, 1\] is not an affine"),
        ("nan", r"drivers: \[2, 1\] is not a finite number"),
        ("short", r"drivers: has shape \[\d+, 3\], expected"),
        ("parents", "parents: joint 2 has parent 3; parents must come before children"),
        ("names", "driver_names: holds an empty name, or a name twice"),
        ("empty", "take: has no frame"),
    ],
)
def test_unsound_drivers_are_refused(flame: Path, tmp_path: Path, name: str, said: str) -> None:
    with pytest.raises(AvatarError, match=said):
        drivers.checked(_spoiled(_made(flame, 3), name), tmp_path / "drivers.npz")


def test_files_that_are_none_are_refused(flame: Path, tmp_path: Path) -> None:
    file = tmp_path / "drivers.npz"
    drivers.write(_made(flame, 3), file, force=False)
    arrays = dict(np.load(file))
    np.savez(file, **{name: array for name, array in arrays.items() if name != "take"})
    with pytest.raises(AvatarError, match="take: is missing"):
        drivers.read(file)
    np.savez(file, **(arrays | {"take": arrays["take"].astype(float)}))
    with pytest.raises(AvatarError, match="take: has type float64, whole numbers are needed"):
        drivers.read(file)
    np.savez(file, **(arrays | {"joint_names": np.arange(5)}))
    with pytest.raises(AvatarError, match="joint_names: expected a list of names"):
        drivers.read(file)


def test_the_command(flame: Path, tmp_path: Path, run: Run) -> None:
    out = tmp_path / "drivers.npz"
    code, said, _ = run("poses", flame, "-o", out, "--frames", 10)
    assert code == 0 and "frames of 3 drivers and 5 joints, in takes of 7, 19, 2, 2, 2, 2, 2" in " ".join(
        said.split()
    )
    assert drivers.read(out).frames == 36
    code, _, error = run("poses", flame, "-o", out)
    assert code == 2 and "exists" in error
    code, _, error = run("poses", tmp_path / "none.glb", "-o", tmp_path / "x.npz")
    assert code == 2 and "none.glb" in error and not (tmp_path / "x.npz").exists()


def test_smpl_x_has_names_and_expressions(tmp_path: Path) -> None:
    """The smaller file: 10 identity directions, then 10 expressions."""
    parents = (-1, *[0] * 54)
    model = body_files.body(parents)
    v = len(model["v_template"])
    path = tmp_path / "SMPLX.npz"
    np.savez(
        path,
        v_template=model["v_template"],
        f=model["triangles"],
        shapedirs=np.zeros((v, 3, 20), "f4"),
        posedirs=model["posedirs"],
        J_regressor=model["regressor"],
        weights=model["weights"],
        kintree_table=np.array([parents, range(55)]),
    )
    made = _made(path, 2)
    assert len(made.driver_names) == 10 and made.joint_names[22:25] == (
        "jaw",
        "left_eye_smplhf",
        "right_eye_smplhf",
    )
