"""The poses to dump: what drivers.npz holds, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.distill import drivers
from avatar_export.distill.embed import under, unscaled
from avatar_export.distill.poses import BODY_RANGE, MORPH_RANGE, driven, poses_to_dump
from avatar_runtime.rules import AREA_SCALES
from avatar_runtime.stages.surface import SCALES, prepare, triangle_shape
from avatar_schema import constants
from tests.avatars import surface_avatar
from tests.commands import Run
from tests.exporter.bodies import body_files
from tests.exporter.bodies.test_body_model import put
from tests.exporter.distill.conftest import with_arrays
from tests.exporter.refusals import refused
from tests.exporter.rigs import rig_files
from tests.oracles import lbs

Array = npt.NDArray[Any]

DOUBLE = 1e-12


@pytest.fixture
def flame(tmp_path: Path) -> Path:
    return body_files.write_body(tmp_path / "flame.npz", body_files.body(body_files.FLAME_PARENTS))


def _made(path: Path, count: int | None = None, seed: int = 0, shape: Path | None = None) -> drivers.Drivers:
    return poses_to_dump(driven(path, shape, 15.0), count, seed)


def turns_of(made: drivers.Drivers) -> Array:
    """[F, J, 3, 3] how each joint turns against its parent, in its rest frame."""
    parts = made.world_from_joint[..., :3, :3], made.rest[:, :3, :3]
    root = (made.parents < 0)[:, None, None]
    above, above_rest = (np.where(root, np.eye(3), part[..., made.parents, :, :]) for part in parts)
    return np.linalg.inv(parts[1]) @ above_rest @ np.linalg.inv(above) @ parts[0]


def test_joints_are_those_of_the_body_model(flame: Path, tmp_path: Path) -> None:
    model = body_files.body(body_files.FLAME_PARENTS)
    shape = np.array([1.0, -0.5, 0.3, 0.8])
    np.save(tmp_path / "shape.npy", shape)
    made = _made(flame, shape=tmp_path / "shape.npy")
    turns = turns_of(made)
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
    turns = np.abs(turns_of(made) - np.eye(3)).max(axis=(2, 3)) > 1e-9
    assert made.driver_names == ("exp_000", "exp_001", "exp_002")
    frames = list(zip(made.drivers, turns, strict=True))
    alone = {(*row.nonzero()[0], row.sum()) for row, turned in frames if not turned.any() and row.any()}
    single = {tuple(np.flatnonzero(turned)) for row, turned in frames if not row.any() and turned.any()}
    assert alone >= {(k, end) for k in range(3) for end in BODY_RANGE}
    assert single >= {(1,), (2,), (3,), (4,)} and not turns[:, 0].any(), "roots stay"
    assert not turns[0].any() and not made.drivers[0].any(), "the first frame is the rest pose"


def lbs_vectors(rotations: Array) -> Array:
    """Rotation vectors of small rotations, by their skew parts."""
    skew = np.stack([rotations[:, k - 1, k - 2] - rotations[:, k - 2, k - 1] for k in range(3)], axis=1)
    sine = np.linalg.norm(skew, axis=1) / 2
    vectors = skew / 2 * (np.arcsin(sine) / np.maximum(sine, 1e-12))[:, None]
    assert np.abs(np.stack([lbs.rodrigues(v) for v in vectors]) - rotations).max() < 1e-9
    return vectors


def test_a_rig_of_a_glb_has_its_morph_targets(tmp_path: Path) -> None:
    path = tmp_path / "rig.glb"
    path.write_bytes(rig_files.rig_glb())
    made = _made(path, 100)
    assert made.driver_names and made.joint_names
    assert made.drivers.min() == MORPH_RANGE[0] and made.drivers.max() == MORPH_RANGE[1]
    random = made.drivers[made.take > 1]
    assert 0.1 < np.mean(random > 0) < 0.5
    refused("--shape: goes with a body model", driven, path, path, 15.0)


def test_rotations_are_in_the_rest_frames_of_the_joints(tmp_path: Path) -> None:
    made = _made(Path(__file__).parents[3] / "samples" / "data" / "CesiumMan.glb", 5)
    drivers.write(made, tmp_path / "d.npz", force=False)
    found = drivers.read(tmp_path / "d.npz")
    assert found.driver_names == () and found.drivers.shape == (found.frames, 0)  # no morph targets
    assert np.abs(made.rest[3, :3, :3] - np.eye(3)).max() > 0.1, "a rest frame that is turned"
    vectors = lbs_vectors(turns_of(made)[made.take == 0].reshape(-1, 3, 3)).reshape(-1, 19, 3)
    assert np.abs(vectors[0]).max() < 1e-5
    for vector in vectors[1:]:
        turned = np.abs(vector) > 1e-4
        assert turned.sum() == 1 and abs(abs(vector[turned][0]) - np.radians(15)) < 1e-5


@pytest.mark.parametrize(
    ("field", "change", "said"),
    [
        ("world_from_joint", put((3, 1), np.diag((0.0, 0, 0, 1))), r"\[3, 1\] is not an affine matrix with an inverse"),
        ("drivers", put((2, 1), np.nan), r"\[2, 1\] is not a finite number"),
        ("drivers", lambda a: a[:-1], r"has shape \[\d+, 3\], expected"),
        ("parents", put(slice(5), [-1, 0, 3, 1, 1]), "joint 2 has parent 3; parents must come before children"),
        ("driver_names", lambda names: ("a", "a", "b"), "holds an empty name, or a name twice"),
        ("take", None, "has no frame"),
    ],
)  # fmt: skip
def test_unsound_drivers(flame: Path, tmp_path: Path, field: str, change: Any, said: str) -> None:
    made = _made(flame, 3)
    fields = {field: change(getattr(made, field))} if change else {}
    if not change:
        fields = {name: getattr(made, name)[:0] for name in ("world_from_joint", "drivers", "take")}
    refused(f"{field}: {said}", drivers.checked, replace(made, **fields), tmp_path / "drivers.npz")


def test_unsound_files(flame: Path, tmp_path: Path) -> None:
    file = tmp_path / "drivers.npz"
    for change, said in (
        ({"take": None}, "take: is missing"),
        ({"take": np.zeros(3)}, "take: has type float64, whole numbers are needed"),
        ({"joint_names": np.arange(5)}, "joint_names: expected a list of names"),
    ):
        drivers.write(_made(flame, 3), file, force=True)
        with_arrays(tmp_path, **change)
        refused(said, drivers.read, file)


def test_the_command(flame: Path, tmp_path: Path, run: Run) -> None:
    out = tmp_path / "drivers.npz"
    code, said, _ = run("poses", flame, "-o", out, "--frames", 10)
    assert code == 0 and "frames of 3 drivers and 5 joints, in takes of 7, 19, 2," in " ".join(said.split())
    assert drivers.read(out).frames == 36
    code, _, error = run("poses", flame, "-o", out)
    assert code == 2 and "exists" in error
    code, _, error = run("poses", tmp_path / "none.glb", "-o", tmp_path / "x.npz")
    assert code == 2 and "none.glb" in error and not (tmp_path / "x.npz").exists()


@pytest.mark.parametrize("rule", AREA_SCALES)
def test_a_scale_rule_is_undone(rule: str) -> None:
    """What the stage does to log scales on a stretched mesh is taken back."""
    avatar = surface_avatar()
    e, rules = avatar.embedding, replace(avatar.rules, scale=rule)
    assert e is not None
    held, stretched = prepare(e, rules, 4.0), e.canonical_vertices * np.float32([1.5, 1, 0.8])
    given = SCALES[rule](held, triangle_shape(stretched, e.triangles, rules), avatar.gaussians.log_scale)
    damping = float(constants()["area_damping"])
    found = unscaled(rule, under(held, [stretched]), given[None], 4.0, damping)[0]
    np.testing.assert_allclose(found, avatar.gaussians.log_scale, atol=1e-5)
