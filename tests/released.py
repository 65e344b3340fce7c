"""Bundles of released versions: one tiny avatar of every system, and the numbers that playing it gave then.

`python -m tests.released` writes those of this version into tests/data/bundles/VERSION and refuses to replace any.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt
from samples.subjects.body_files import save_tracked_frame
from samples.subjects.head import load_head, simplify
from samples.systems.gaussian_blendshapes import build_model
from samples.systems.gaussian_blendshapes_files import save_cfg_args, save_dump

from avatar_export import __version__
from avatar_export.asm.files import save as save_asm
from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_trainer.head import build_body_model, save_body
from tests.asm_faces import small_face
from tests.avatars import full_avatar
from tests.exporter.bodies import body_files
from tests.exporter.readers import lam_files, psavatar_run, splatting_files

Array = npt.NDArray[Any]

DATA = Path(__file__).parent / "data" / "bundles"
CELL = 0.045  # metres between vertices of the scanned head
GAUSSIANS = 24
SPLATS = ("mean", "scale", "quat_wxyz", "opacity", "sh")


def gaussian_blendshapes(folder: Path) -> Avatar:
    """The scanned head, coarse: five joints, 51 expressions, eyelids, both rows of teeth."""
    head = simplify(load_head(), CELL)
    body = build_body_model(head, moving_joints=True)
    identity = np.zeros(len(head.identity))
    save_cfg_args(folder / "model")
    save_dump(build_model(head, body, GAUSSIANS), folder / "model")
    save_body(body, identity, folder / "body")
    save_tracked_frame(identity, folder / "dataset" / "checkpoint" / "00000.frame")
    return read(folder / "model", ReadOptions(dataset=folder))


def splatting_avatar(folder: Path) -> Avatar:
    """Gaussians embedded in a small body model of FLAME's layout."""
    obj = splatting_files.obj_text(psavatar_run.BODY["v_template"], psavatar_run.BODY["triangles"])
    splatting_files.write_splatting_run(folder / "run", splatting_files.arrays(), obj=obj)
    return read(folder / "run", _on_body(folder))


def gaussian_avatars(folder: Path) -> Avatar:
    """Gaussians in the frames of the triangles of the same body model."""
    splatting_files.write_gaussian_run(folder / "run", splatting_files.arrays(), vertices=None)
    return read(folder / "run", _on_body(folder))


def psavatar(folder: Path) -> Avatar:
    """Points above the same body model, with expressions of their own."""
    psavatar_run.write_run(folder / "run", psavatar_run.arrays())
    return read(folder / "run", _on_body(folder))


def lam(folder: Path) -> Avatar:
    """One Gaussian a vertex of a skinned .glb."""
    for name, data in lam_files.files(animation=None).items():
        (folder / name).write_bytes(data)
    return read(folder)


def asm(folder: Path) -> Avatar:
    """A face of 12 bones with two takes; it does not rest in its binding pose."""
    save_asm(small_face(), folder / "face.npz")
    return read(folder / "face.npz")


def every_field(_: Path) -> Avatar:
    """An avatar with a value in every field of the format: clips, driving, all kinds of groups, an enhancer."""
    return full_avatar()


MAKE: dict[str, Callable[[Path], Avatar]] = {
    "gaussian_blendshapes": gaussian_blendshapes,
    "splatting_avatar": splatting_avatar,
    "gaussian_avatars": gaussian_avatars,
    "psavatar": psavatar,
    "lam": lam,
    "asm": asm,
    "every_field": every_field,
}
LEFT_HANDED = {"every_field"}
WITH_ENGINE_FILES = {"every_field"}
WITH_REFERENCE = {
    "lam",
    "splatting_avatar",
}  # one of skin, one of surface; it is the largest part of a tiny bundle


def _on_body(folder: Path) -> ReadOptions:
    body = body_files.write_body(folder / "body.npz", psavatar_run.BODY)
    return ReadOptions(body_model=body, shape=Path("zero"))


def write(name: str, folder: Path) -> Path:
    """FOLDER/NAME.avatar.zip and the vectors beside it; returns the bundle."""
    with TemporaryDirectory() as made:
        avatar = MAKE[name](Path(made))
    out = folder / f"{name}.avatar.zip"
    write_bundle(
        replace(avatar, name=name),
        out,
        preview=False,
        engine_files=name in WITH_ENGINE_FILES,
        reference=name in WITH_REFERENCE,
        handedness="left" if name in LEFT_HANDED else "right",
    )
    np.savez_compressed(vectors_of(out), **played(load(out), pose_arrays(load(out))))
    return out


def vectors_of(bundle: Path) -> Path:
    """Where the vectors of a bundle lie."""
    return bundle.with_name(bundle.name.removesuffix(".avatar.zip") + ".npz")


def pose_arrays(avatar: Avatar) -> dict[str, Array]:
    """A pose that uses every input of `avatar`, in the order of its manifest; the whole is turned and moved."""
    rng = np.random.default_rng(13)
    joints = len(avatar.rig.joint_names) if avatar.rig else 0
    deltas = [homogeneous(matrix_from_rotvec(rng.normal(0, 0.2, 3))) for _ in range(joints)]
    return {
        "expressions": rng.uniform(0, 1, len(avatar.expressions)),
        "eyelids": rng.uniform(0, 1, len(avatar.eyelids)),
        "joints": np.array(deltas).reshape(joints, 4, 4),
        "world_from_avatar": homogeneous(
            matrix_from_rotvec(np.array([0.1, 0.3, -0.2])), np.array([0, 0.1, 0.02])
        ),
    }


def played(avatar: Avatar, pose: dict[str, Array]) -> dict[str, Array]:
    """`pose`, and the Gaussians of `avatar` in it as backend `reference` gives them."""
    posed = Player(avatar, "reference").animate(
        Pose(
            dict(zip(avatar.expression_names, pose["expressions"].tolist(), strict=True)),
            dict(zip(avatar.rig.joint_names if avatar.rig else (), pose["joints"], strict=True)),
            dict(zip(avatar.eyelids, pose["eyelids"].tolist(), strict=True)),
            pose["world_from_avatar"],
        )
    )
    return pose | {name: getattr(posed, name) for name in SPLATS}


def main() -> None:
    """Write every bundle of this version."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DATA / __version__
    if folder.exists():
        sys.exit(f"{folder} exists; bundles of a released version are never replaced")
    for name in MAKE:
        print(write(name, folder))


if __name__ == "__main__":
    main()
