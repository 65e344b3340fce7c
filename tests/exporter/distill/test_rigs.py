"""`distill` with the mesh that posed the dumps, given as a file of each kind; and packs and pages of what it writes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.asm.files import save
from avatar_export.distill import drivers
from avatar_export.distill.poses import driven
from avatar_runtime.avatar import Avatar, Driving, Expression, SparseRows
from avatar_runtime.stages.surface import binding_pose
from tests.asm_faces import small_face
from tests.avatars import surface_avatar
from tests.commands import Run
from tests.exporter.bodies import body_files
from tests.exporter.distill.conftest import copied, with_arrays
from tests.exporter.rigs import fbx_files, rig_files

TAKES = (24, 6)  # frames; the last take is held out
SHAPE = np.array([1.0, -0.5, 0.3, 0.8])
Kind = tuple[str, str, Callable[[Path], object]]  # option, name of the file, what writes it
KINDS: dict[str, Kind] = {
    "FLAME": ("--body-model", "flame.npz", lambda file: body_files.write_body(file, FLAME)),
    "glb": ("--rig", "rig.glb", lambda file: file.write_bytes(rig_files.rig_glb())),
    "fbx": ("--rig", "rig.fbx", lambda file: file.write_bytes(fbx_files.fbx())),
    "ASM": ("--rig", "face.npz", lambda file: save(small_face(turned=False), file)),
}
FLAME = {**body_files.body(body_files.FLAME_PARENTS), "v_template": rig_files.vertices()}  # a smooth mesh


def carried(file: Path, shape: Path | None = None) -> Avatar:
    """Gaussians on the mesh of a rig, which nothing but the mesh moves."""
    source = driven(file, shape, 15.0)
    rig, names, base = source.rig, source.driver_names, surface_avatar(3)
    known = base.embedding
    assert known is not None
    n, k, features = base.gaussians.count, len(names), 9 * len(rig.corrective_joints)
    triangle = np.random.default_rng(0).integers(0, len(rig.triangles), n).astype(np.uint32)
    embedding = replace(known, canonical_vertices=rig.vertices, triangles=rig.triangles, triangle=triangle)
    mean, quat = binding_pose(embedding, base.rules, base.training_per_bundle)
    columns = {"geometry": k, "appearance": k, "correctives": features, "late_morphs": 0}
    shapes = {name: replace(getattr(base.blendshapes, name), columns=c) for name, c in columns.items()}
    return replace(
        base,
        gaussians=replace(base.gaussians, mean=mean, quat_wxyz=quat),
        expressions=tuple(map(Expression, names)),
        eyelids=(),
        blendshapes=replace(base.blendshapes, **shapes),
        skin=SparseRows.empty(n, rig.joint_count, {"weight": ()}),
        rig=rig,
        driving=Driving(),
        embedding=embedding,
        clips=(),
    )


def dumped(avatar: Avatar, folder: Path) -> Path:
    """Dumps of random poses, the last take of which is held out."""
    takes = [random_poses(avatar, count, 8.0, seed=count) for count in TAKES]
    return write_dumps(avatar, takes, folder)


@pytest.fixture
def flame(tmp_path: Path) -> Path:
    """A body model."""
    return body_files.write_body(tmp_path / "flame.npz", FLAME)


@pytest.fixture
def shape(tmp_path: Path) -> Path:
    """An identity of the body model."""
    np.save(tmp_path / "shape.npy", SHAPE)
    return tmp_path / "shape.npy"


@pytest.mark.parametrize("kind", KINDS)
def test_the_rig_that_posed_the_dumps_is_found_to_carry_them(kind: str, tmp_path: Path, run: Run) -> None:
    option, name, write = KINDS[kind]
    write(tmp_path / name)
    folder = dumped(carried(tmp_path / name), tmp_path / "dumps")
    code, said, error = run("distill", folder, "-o", tmp_path / "out", option, tmp_path / name, "--dry-run")
    assert code == 0, error
    assert "embedding on the mesh" in said and "has the least error on held-out frames" in error
    millimetres = float(said.split(" mm,")[0].split()[-1])
    assert millimetres < 0.1


def test_a_body_model_takes_a_shape(flame: Path, shape: Path, tmp_path: Path, run: Run) -> None:
    folder = dumped(carried(flame, shape), tmp_path / "dumps")
    words = ("distill", folder, "-o", tmp_path / "out", "--dry-run", "--body-model", flame)
    code, said, error = run(*words, "--shape", shape)
    assert code == 0 and "embedding on the mesh" in said, error
    code, _, error = run(*words, "--force")
    assert code == 2 and "mm from that of the rig" in error and "(--shape) of the body model" in error


def test_bad_options(flame: Path, shape: Path, few: Path, tmp_path: Path, run: Run) -> None:
    (tmp_path / "rig.glb").write_bytes(rig_files.rig_glb())
    (tmp_path / "rig.txt").write_bytes(b"")
    loose = copied(few, tmp_path / "loose")
    frames = drivers.read(loose / drivers.FILE).frames
    none = {"joint_names": np.zeros(0, "U1"), "parents": np.zeros(0, np.int64), "rest": np.zeros((0, 4, 4))}
    with_arrays(loose, **none, world_from_joint=np.zeros((frames, 0, 4, 4)))
    for folder, words, wanted in (
        (few, ("--rig", tmp_path / "rig.glb"), "drivers.npz: joint_names: lacks joint"),
        (few, ("--rig", tmp_path / "rig.txt"), "rig.txt: is not a rig that can be read"),
        (few, ("--rig", tmp_path / "none.glb"), "none.glb"),
        (few, ("--body-model", tmp_path / "rig.glb"), "rig.glb"),
        (few, ("--shape", shape), "goes with --body-model"),
        (few, ("--body-model", flame, "--rig", tmp_path / "rig.glb"), "--body-model"),
        (loose, ("--body-model", flame), "drivers.npz: has no joints, so a rig cannot help"),
    ):
        code, _, error = run("distill", folder, "-o", tmp_path / "out", *words)
        assert code == 2 and wanted in " ".join(error.replace("│", " ").split()), (words, error)
        assert not list(tmp_path.glob("out*")), "nothing is half written"
