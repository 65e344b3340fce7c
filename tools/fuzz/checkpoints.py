"""Small sound checkpoints of every system that is read, and dumps of posed Gaussians: each function writes folders."""

from __future__ import annotations

from pathlib import Path

from samples.dumps import random_poses, write_dumps
from samples.make import make_gaussian_blendshapes
from tests.asm_faces import small_face
from tests.avatars import full_avatar
from tests.exporter.readers import lam_files, lhm_files, psavatar_run, rgbavatar_files, splatting_files

from avatar_export.asm import files as asm_files

FEW, COARSE = (
    160,
    0.03,
)  # Gaussians of the sample of Gaussian Blendshapes, metres between vertices of its mesh


def blendshapes(folder: Path) -> None:
    written = make_gaussian_blendshapes(folder / "work", FEW, form="both", full=True, cell=COARSE)
    written.rename(folder / "blendshapes")
    (folder / "work").rmdir()


def splatting(folder: Path) -> None:
    splatting_files.write_splatting_run(folder / "new", splatting_files.arrays(3))
    old = splatting_files.legacy(splatting_files.arrays())
    splatting_files.write_splatting_run(
        folder / "old", splatting_files.arrays(), embedding=old, form="canonical.sample.json"
    )


def bound(folder: Path) -> None:
    splatting_files.write_gaussian_run(folder / "run", splatting_files.arrays(2))
    (folder / "run" / "mesh.obj").write_text(splatting_files.obj_text())


def psavatar(folder: Path) -> None:
    psavatar_run.write_run(folder / "run", psavatar_run.arrays(), {"order": "mesh_first"})


def lam(folder: Path) -> None:
    folder.joinpath("zip").mkdir()
    lam_files.write_zip(folder / "zip" / "head.zip", lam_files.files())


def faces(folder: Path) -> None:
    for seed, turned in enumerate((True, False)):
        (folder / str(seed)).mkdir()
        asm_files.save(small_face(seed, turned=turned), folder / str(seed) / "face.npz")


def rgbavatar(folder: Path) -> None:
    rgbavatar_files.run().write(folder / "run")


def lhm(folder: Path) -> None:
    (folder / "person").mkdir()
    lhm_files.Person(folder / "person")


def dumps(folder: Path) -> None:
    avatar = full_avatar(3)
    poses = random_poses(avatar, 6, 3.0)
    write_dumps(avatar, [poses[:4], poses[4:]], folder / "six")
