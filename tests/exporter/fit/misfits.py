"""Inputs that do not belong together, made of sound samples: what a user might pass by mistake.

Each entry makes its files in a folder and returns what `avatar_export.read` takes. Nothing here knows how misfits are
found.
"""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData
from samples.make import make_body, make_gaussian_blendshapes, make_lam, make_splatting_head

Given = tuple[Path, dict[str, Any]]  # source, options
Make = Callable[["Bases", Path], Given]
Arrays = dict[str, Any]


@dataclass(frozen=True)
class Bases:
    """Sound inputs of each system."""

    blendshapes: Path
    head: Path
    body: Path
    lam: Path

    @staticmethod
    def make(folder: Path) -> Bases:
        """Small conformance samples."""
        return Bases(
            make_gaussian_blendshapes(folder, full=True),
            make_splatting_head(folder, sh_degree=3, full=True),
            make_body(folder, 1000),
            make_lam(folder, full=True),
        )


def blendshapes(bases: Bases) -> Given:
    """The sound Gaussian Blendshapes model with all its inputs."""
    base, body = bases.blendshapes, bases.blendshapes / "body"
    return base / "model", {
        "body_model": body / "body_model.npz",
        "shape": base / "dataset" / "checkpoint" / "00000.frame",
        "anchor_faces": body / "back_of_head.txt",
        "eyelids": body,
    }


def head(bases: Bases, *names: str) -> Given:
    """The sound SplattingAvatar head, on its body model and tracked poses, or with some of these options."""
    base = bases.head
    given = {"body_model": base / "body" / "body_model.npz", "poses": base / "flame_params.json"}
    return base / "run", {name: given[name] for name in names}


SOUND: dict[str, Callable[[Bases], Given]] = {
    "blendshapes": blendshapes,
    "head": lambda bases: head(bases, "body_model", "poses"),
    "body": lambda bases: (bases.body / "run", {"rig": bases.body / "CesiumMan.glb"}),  # on a generic rig
    "lam": lambda bases: (bases.lam, {}),
    "head without a rig": head,
    "head without poses": lambda bases: head(bases, "body_model"),
}


# --- changes of one file -------------------------------------------------------------------------------------------


def given(of: str = "blendshapes", **options: Any) -> Make:
    """Another option beside the sound files."""
    return lambda bases, _: (SOUND[of](bases)[0], SOUND[of](bases)[1] | options)


def written(option: str, name: str, write: Callable[[Path, Path], object], of: str = "blendshapes") -> Make:
    """Another file of an option: `write(file, its sound one)` makes it."""

    def make(bases: Bases, folder: Path) -> Given:
        source, options = SOUND[of](bases)
        write(folder / name, options[option])
        return source, options | {option: folder / name}

    return make


def copied(change: Callable[[Path], object], of: str = "blendshapes") -> Make:
    """Another folder of a model or run, changed."""

    def make(bases: Bases, folder: Path) -> Given:
        source, options = SOUND[of](bases)
        copy = folder / source.name
        shutil.copytree(source, copy, ignore=shutil.ignore_patterns("*.pth", "acc*"))
        change(copy)
        return copy, options

    return make


def body_model(change: Callable[[Arrays], object], of: str = "blendshapes") -> Make:
    """Another body model file."""

    def write(path: Path, sound: Path) -> None:
        with np.load(sound) as file:
            arrays = dict(file)
        change(arrays)
        np.savez(path, **arrays)

    return written("body_model", "body_model.npz", write, of)


def points(change: Callable[[Any], Any]) -> Make:
    """The body model with other vertices: every length of the file changes alike."""

    def edit(a: Arrays) -> None:
        at_zero = change(np.zeros((1, 3), "f8"))
        a["v_template"] = change(a["v_template"].astype("f8")).astype("f4")
        for name in ("shapedirs_identity", "shapedirs_expression", "posedirs"):
            moved = change(np.moveaxis(a[name].astype("f8"), 1, 2).reshape(-1, 3)) - at_zero
            v, _, k = a[name].shape
            a[name] = np.moveaxis(moved.reshape(v, k, 3), 2, 1).astype("f4")

    return body_model(edit)


def shape(change: Callable[[Any], Any]) -> Make:
    """Another identity file."""

    def write(path: Path, sound: Path) -> None:
        identity = np.load(sound.parents[2] / "body" / "shape.npy")
        np.save(path, change(identity.reshape(-1)))

    return written("shape", "shape.npy", write)


def eyelids(change: Callable[[Any, Any], tuple[Any, Any]]) -> Make:
    """Other eyelid files."""

    def write(folder: Path, sound: Path) -> None:
        folder.mkdir()
        both = (np.load(sound / f"{side}_eyelid.npy") for side in "lr")
        for side, values in zip("lr", change(*both), strict=True):
            np.save(folder / f"{side}_eyelid.npy", values)

    return written("eyelids", "eyelids", write)


def array(name: str, change: Callable[[Any], Any]) -> Make:
    """Another array in the model folder."""

    def edit(folder: Path) -> None:
        values = np.load(folder / name)
        np.save(folder / name, change(values).astype(values.dtype))

    return copied(edit)


def anchors_on_the_jaw(bases: Bases, folder: Path) -> Given:
    """The anchor faces are those of the chin."""
    source, options = blendshapes(bases)
    with np.load(options["body_model"]) as a:
        on_jaw = (a["lbs_weights"][a["faces"]][:, :, 2] > 0.9).all(axis=1)
    (folder / "faces.txt").write_text(" ".join(map(str, np.flatnonzero(on_jaw)[:40])))
    return source, options | {"anchor_faces": folder / "faces.txt"}


def edited(change: Callable[[Any], object]) -> Callable[[Path, Path], None]:
    """Writes a JSON file that `change` has altered."""

    def write(path: Path, sound: Path) -> None:
        document = json.loads(sound.read_text())
        change(document)
        path.write_text(json.dumps(document))

    return write


def lam_offsets(factor: float) -> Make:
    """A LAM zip whose offsets have another unit."""

    def make(bases: Bases, folder: Path) -> Given:
        out = folder / "head.zip"
        with zipfile.ZipFile(bases.lam) as old, zipfile.ZipFile(out, "w") as new:
            for name in old.namelist():
                data = old.read(name)
                if name.endswith("offset.ply"):
                    ply, stream = PlyData.read(io.BytesIO(data)), io.BytesIO()
                    for axis in "xyz":
                        ply["vertex"][axis] *= factor
                    ply.write(stream)
                    data = stream.getvalue()
                new.writestr(name, data)
        return out, {}

    return make


def obj(change: Callable[[Any], Any], of: str = "head") -> Make:
    """The mesh of a run with other vertices."""

    def edit(folder: Path) -> None:
        path = next(folder.rglob("embedding.obj"))
        lines = path.read_text().splitlines()
        rows = [k for k, line in enumerate(lines) if line.startswith("v ")]
        moved = change(np.array([[float(x) for x in lines[k].split()[1:4]] for k in rows]))
        for k, vertex in zip(rows, moved, strict=True):
            lines[k] = "v " + " ".join(f"{x:.6f}" for x in vertex)
        path.write_text("\n".join(lines) + "\n")

    return copied(edit, of)


# --- the changes ---------------------------------------------------------------------------------------------------


def _times(factor: float) -> Callable[[Any], Any]:
    return lambda values: factor * values


def _moved(*by: float) -> Callable[[Any], Any]:
    return lambda points: points + np.array(by)


def _z_up(p: Any) -> Any:
    return np.stack([p[:, 0], -p[:, 2], p[:, 1]], axis=1)


def _reversed_expressions(a: Arrays) -> None:
    a["shapedirs_expression"] = a["shapedirs_expression"][:, :, ::-1].copy()
    a["expression_names"] = a["expression_names"][::-1].copy()


def _times_arrays(factor: float, *names: str) -> Callable[[Arrays], object]:
    return lambda a: a.update({name: (factor * a[name]).astype("f4") for name in names})


def _joints_exchanged(a: Arrays) -> None:
    a["lbs_weights"] = np.ascontiguousarray(a["lbs_weights"][:, [3, 2, 1, 0, 4]])


def _older_mouths(folder: Path) -> None:
    for stem in ("mouth0", "mouth1"):
        (folder / f"{stem}_chkpnt40000").rename(folder / f"{stem}_chkpnt30000")


def _newer_incomplete(folder: Path) -> None:
    new = folder / "fix_chkpnt50000"
    new.mkdir()
    for name in ("xyz_t.npy", "pos.npy"):
        shutil.copy(folder / "fix_chkpnt40000" / name, new)


def _without_embedding(folder: Path) -> None:
    new = shutil.copytree(folder / "point_cloud/iteration_30000", folder / "point_cloud/iteration_40000")
    (new / "embedding.json").unlink()


def _lifted(folder: Path) -> None:
    path = next(folder.rglob("embedding.json"))
    edited(lambda document: document.update(_xyz=[[x, y, 1000 * z] for x, y, z in document["_xyz"]]))(
        path, path
    )


def _other_shape(document: Arrays) -> None:
    document["shape_params"] = [-x for x in document["shape_params"]]


def _moved_poses(document: Arrays) -> None:
    for frame in document["frames"]:
        frame["pose"][3:6] = [0.0, 1.2, 0.0]  # the neck


def _poses(change: Callable[[Arrays], object]) -> Make:
    return written("poses", "flame_params.json", edited(change), "head")


LENGTHS = ("v_template", "shapedirs_identity", "shapedirs_expression")

MISFITS: dict[str, Make] = {
    "FLAME in millimetres": points(_times(1000.0)),
    "FLAME in centimetres": points(_times(100.0)),
    "FLAME in inches": points(_times(1 / 0.0254)),
    "FLAME times 4, as SplattingAvatar enlarges it": points(_times(4.0)),
    "FLAME moved by half a metre": points(_moved(0, 0.5, 0)),
    "FLAME moved by 2 cm": points(_moved(0.02, 0, 0)),
    "FLAME with z up": points(_z_up),
    "FLAME with z up, in millimetres": points(lambda p: 1000 * _z_up(p)),
    "FLAME turned round, the face along -Z": points(lambda p: p * [-1, 1, -1]),
    "FLAME mirrored": points(lambda p: p * [-1, 1, 1]),
    "`--body-scale 1000`": given(body_scale=1000.0),
    "`--body-scale 4`": given(body_scale=4.0),
    "a negated identity": shape(lambda c: -c),
    "`--shape zero` on a subject that has one": given(shape=Path("zero")),
    "a shape of two coefficients": shape(lambda c: c[:2]),
    "expressions in reverse order": body_model(_reversed_expressions),
    "expression directions ten times too large": body_model(_times_arrays(10.0, "shapedirs_expression")),
    "pose correctives with the other sign": body_model(_times_arrays(-1.0, "posedirs")),
    "skin weights in another order of joints": body_model(_joints_exchanged),
    "joint regressor in millimetres": body_model(_times_arrays(1000.0, "J_regressor")),
    "left and right eyelid exchanged": eyelids(lambda left, right: (right, left)),
    "eyelids in millimetres": eyelids(lambda left, right: (1000 * left, 1000 * right)),
    "anchor faces on the chin": anchors_on_the_jaw,
    "upper teeth in millimetres": array("mouth0_chkpnt40000/pos.npy", _times(1000.0)),
    "lower teeth moved by 10 cm": array("mouth1_chkpnt40000/pos.npy", _moved(0, 0, 0.1)),
    "a face of iteration 40000, mouths of 30000": copied(_older_mouths),
    "Gaussian Blendshapes: the newest iteration lacks files": copied(_newer_incomplete),
    "SplattingAvatar: body model in millimetres (216 m off)": body_model(_times_arrays(1000.0, *LENGTHS), "head"),
    "SplattingAvatar: `--units 1` for a head times 4 (650 mm off)": given("head", units=1.0),
    "SplattingAvatar: `--units 4000`": given("head", units=4000.0),
    "SplattingAvatar: embedding.obj moved by half a metre": obj(_moved(0, 2, 0)),
    "SplattingAvatar: embedding.obj with z up": obj(_z_up),
    "SplattingAvatar: displacements in millimetres": copied(_lifted, "head"),
    "SplattingAvatar: poses of another identity": _poses(_other_shape),
    "SplattingAvatar: `--shape zero` beside poses with an identity": given("head", shape=Path("zero")),
    "SplattingAvatar: poses of another take": _poses(_moved_poses),
    "SplattingAvatar: the newest iteration lacks embedding.json": copied(_without_embedding, "head"),
    "SplattingAvatar: the newest iteration is an empty folder": copied(
        lambda folder: (folder / "point_cloud" / "iteration_60000").mkdir(), "head"
    ),
    "SplattingAvatar: a generic rig, embedding.obj in centimetres": obj(_times(100.0), "body"),
    "LAM: offsets in millimetres": lam_offsets(1000.0),
}  # fmt: skip
