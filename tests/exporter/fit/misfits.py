"""Inputs that do not belong together, made of sound samples: what a user might pass by mistake.

Each entry makes its files in a folder and returns what `avatar_export.read` takes. Nothing here knows how misfits are
found, so that the same files can be given to older versions.
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
    base = bases.blendshapes
    body = base / "body"
    return base / "model", {
        "body_model": body / "body_model.npz",
        "shape": base / "dataset" / "checkpoint" / "00000.frame",
        "anchor_faces": body / "back_of_head.txt",
        "eyelids": body,
    }


def head(bases: Bases) -> Given:
    """The sound SplattingAvatar head, on its body model and tracked poses."""
    base = bases.head
    return base / "run", {
        "body_model": base / "body" / "body_model.npz",
        "poses": base / "flame_params.json",
    }


def walker(bases: Bases) -> Given:
    """The sound SplattingAvatar body, on a generic rig."""
    return bases.body / "run", {"rig": bases.body / "CesiumMan.glb"}


SOUND: dict[str, Callable[[Bases], Given]] = {
    "blendshapes": blendshapes,
    "head": head,
    "body": walker,
    "lam": lambda bases: (bases.lam, {}),
    "head without a rig": lambda bases: (bases.head / "run", {}),
    "head without poses": lambda bases: (
        bases.head / "run",
        {"body_model": bases.head / "body" / "body_model.npz"},
    ),
}


# --- changes of one file -------------------------------------------------------------------------------------------


def body_model(change: Callable[[dict[str, Any]], None], of: str = "blendshapes") -> Make:
    """Another body model file."""

    def make(bases: Bases, folder: Path) -> Given:
        source, options = SOUND[of](bases)
        with np.load(options["body_model"]) as file:
            arrays = dict(file)
        change(arrays)
        np.savez(folder / "body_model.npz", **arrays)
        return source, options | {"body_model": folder / "body_model.npz"}

    return make


def points(change: Callable[[Any], Any]) -> Make:
    """The body model with other vertices: every length of the file changes alike."""

    def edit(a: dict[str, Any]) -> None:
        at_zero = change(np.zeros((1, 3), "f8"))
        a["v_template"] = change(a["v_template"].astype("f8")).astype("f4")
        for name in ("shapedirs_identity", "shapedirs_expression", "posedirs"):
            moved = change(np.moveaxis(a[name].astype("f8"), 1, 2).reshape(-1, 3)) - at_zero
            v, _, k = a[name].shape
            a[name] = np.moveaxis(moved.reshape(v, k, 3), 2, 1).astype("f4")

    return body_model(edit)


def options(**given: Any) -> Make:
    """Another option beside the sound files."""
    return lambda bases, _: (blendshapes(bases)[0], blendshapes(bases)[1] | given)


def shape(change: Callable[[Any], Any]) -> Make:
    """Another identity file."""

    def make(bases: Bases, folder: Path) -> Given:
        source, given = blendshapes(bases)
        identity = np.load(bases.blendshapes / "body" / "shape.npy")
        np.save(folder / "shape.npy", change(identity.reshape(-1)))
        return source, given | {"shape": folder / "shape.npy"}

    return make


def eyelids(change: Callable[[Any, Any], tuple[Any, Any]]) -> Make:
    """Other eyelid files."""

    def make(bases: Bases, folder: Path) -> Given:
        source, given = blendshapes(bases)
        both = (np.load(given["eyelids"] / f"{side}_eyelid.npy") for side in "lr")
        for side, values in zip("lr", change(*both), strict=True):
            np.save(folder / f"{side}_eyelid.npy", values)
        return source, given | {"eyelids": folder}

    return make


def model(change: Callable[[Path], None]) -> Make:
    """Another model folder."""

    def make(bases: Bases, folder: Path) -> Given:
        source, given = blendshapes(bases)
        shutil.copytree(source, folder / "model", ignore=shutil.ignore_patterns("*.pth", "acc*"))
        change(folder / "model")
        return folder / "model", given

    return make


def array(name: str, change: Callable[[Any], Any]) -> Make:
    """Another array in the model folder."""

    def edit(folder: Path) -> None:
        values = np.load(folder / name)
        np.save(folder / name, change(values).astype(values.dtype))

    return model(edit)


def run(change: Callable[[Path], None], of: str = "head") -> Make:
    """Another run of SplattingAvatar."""

    def make(bases: Bases, folder: Path) -> Given:
        source, given = SOUND[of](bases)
        shutil.copytree(source, folder / "run")
        change(folder / "run")
        return folder / "run", given

    return make


def head_given(**given: Any) -> Make:
    """Another option beside the sound head."""
    return lambda bases, _: (head(bases)[0], head(bases)[1] | given)


def anchors_on_the_jaw(bases: Bases, folder: Path) -> Given:
    """The anchor faces are those of the chin."""
    source, given = blendshapes(bases)
    with np.load(given["body_model"]) as a:
        on_jaw = (a["lbs_weights"][a["faces"]][:, :, 2] > 0.9).all(axis=1)
    (folder / "faces.txt").write_text(" ".join(map(str, np.flatnonzero(on_jaw)[:40])))
    return source, given | {"anchor_faces": folder / "faces.txt"}


def poses(change: Callable[[dict[str, Any]], None], **given: Any) -> Make:
    """Another flame_params.json."""

    def make(bases: Bases, folder: Path) -> Given:
        source, options_ = head(bases)
        document = json.loads(options_["poses"].read_text())
        change(document)
        (folder / "flame_params.json").write_text(json.dumps(document))
        return source, options_ | {"poses": folder / "flame_params.json"} | given

    return make


def lam_offsets(factor: float) -> Make:
    """A LAM zip whose offsets have another unit."""

    def make(bases: Bases, folder: Path) -> Given:
        out = folder / "head.zip"
        with zipfile.ZipFile(bases.lam) as old, zipfile.ZipFile(out, "w") as new:
            for name in old.namelist():
                data = old.read(name)
                if name.endswith("offset.ply"):
                    ply = PlyData.read(io.BytesIO(data))
                    for axis in "xyz":
                        ply["vertex"][axis] *= factor
                    stream = io.BytesIO()
                    ply.write(stream)
                    data = stream.getvalue()
                new.writestr(name, data)
        return out, {}

    return make


def obj(change: Callable[[Any], Any]) -> Callable[[Path], None]:
    """The mesh of a run with other vertices."""

    def edit(folder: Path) -> None:
        path = next(folder.rglob("embedding.obj"))
        lines = path.read_text().splitlines()
        rows = [k for k, line in enumerate(lines) if line.startswith("v ")]
        moved = change(np.array([[float(x) for x in lines[k].split()[1:4]] for k in rows]))
        for k, vertex in zip(rows, moved, strict=True):
            lines[k] = "v " + " ".join(f"{x:.6f}" for x in vertex)
        path.write_text("\n".join(lines) + "\n")

    return edit


def embedding(change: Callable[[dict[str, Any]], None]) -> Callable[[Path], None]:
    """The embedding.json of a run, changed."""

    def edit(folder: Path) -> None:
        path = next(folder.rglob("embedding.json"))
        document = json.loads(path.read_text())
        change(document)
        path.write_text(json.dumps(document))

    return edit


# --- the changes ---------------------------------------------------------------------------------------------------


def _times(factor: float) -> Callable[[Any], Any]:
    return lambda values: factor * values


def _moved(*by: float) -> Callable[[Any], Any]:
    return lambda points: points + np.array(by)


def _z_up(p: Any) -> Any:
    return np.stack([p[:, 0], -p[:, 2], p[:, 1]], axis=1)


def _reversed_expressions(a: dict[str, Any]) -> None:
    a["shapedirs_expression"] = a["shapedirs_expression"][:, :, ::-1].copy()
    a["expression_names"] = a["expression_names"][::-1].copy()


def _times_array(name: str, factor: float) -> Callable[[dict[str, Any]], None]:
    def edit(a: dict[str, Any]) -> None:
        a[name] = (factor * a[name]).astype("f4")

    return edit


def _in_millimetres(a: dict[str, Any]) -> None:
    for name in ("v_template", "shapedirs_identity", "shapedirs_expression", "posedirs"):
        _times_array(name, 1000.0)(a)


def _joints_exchanged(a: dict[str, Any]) -> None:
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
    old = folder / "point_cloud" / "iteration_30000"
    shutil.copytree(old, folder / "point_cloud" / "iteration_40000")
    (folder / "point_cloud" / "iteration_40000" / "embedding.json").unlink()


def _only_a_folder(folder: Path) -> None:
    (folder / "point_cloud" / "iteration_60000").mkdir()


def _lifted(document: dict[str, Any]) -> None:
    document["_xyz"] = [[x, y, 1000 * z] for x, y, z in document["_xyz"]]


def _other_shape(document: dict[str, Any]) -> None:
    document["shape_params"] = [-x for x in document["shape_params"]]


def _moved_poses(document: dict[str, Any]) -> None:
    for frame in document["frames"]:
        frame["pose"][3:6] = [0.0, 1.2, 0.0]  # the neck


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
    "`--body-scale 1000`": options(body_scale=1000.0),
    "`--body-scale 4`": options(body_scale=4.0),
    "a negated identity": shape(lambda c: -c),
    "`--shape zero` on a subject that has one": options(shape=Path("zero")),
    "a shape of two coefficients": shape(lambda c: c[:2]),
    "expressions in reverse order": body_model(_reversed_expressions),
    "expression directions ten times too large": body_model(_times_array("shapedirs_expression", 10.0)),
    "pose correctives with the other sign": body_model(_times_array("posedirs", -1.0)),
    "skin weights in another order of joints": body_model(_joints_exchanged),
    "joint regressor in millimetres": body_model(_times_array("J_regressor", 1000.0)),
    "left and right eyelid exchanged": eyelids(lambda left, right: (right, left)),
    "eyelids in millimetres": eyelids(lambda left, right: (1000 * left, 1000 * right)),
    "anchor faces on the chin": anchors_on_the_jaw,
    "upper teeth in millimetres": array("mouth0_chkpnt40000/pos.npy", _times(1000.0)),
    "lower teeth moved by 10 cm": array("mouth1_chkpnt40000/pos.npy", _moved(0, 0, 0.1)),
    "a face of iteration 40000, mouths of 30000": model(_older_mouths),
    "Gaussian Blendshapes: the newest iteration lacks files": model(_newer_incomplete),
    "SplattingAvatar: body model in millimetres (216 m off)": body_model(
        lambda a: (
            [_times_array(n, 1000.0)(a) for n in ("v_template", "shapedirs_identity", "shapedirs_expression")]
            and None
        ),
        "head",
    ),
    "SplattingAvatar: `--units 1` for a head times 4 (650 mm off)": head_given(units=1.0),
    "SplattingAvatar: `--units 4000`": head_given(units=4000.0),
    "SplattingAvatar: embedding.obj moved by half a metre": run(obj(_moved(0, 2, 0))),
    "SplattingAvatar: embedding.obj with z up": run(obj(_z_up)),
    "SplattingAvatar: displacements in millimetres": run(embedding(_lifted)),
    "SplattingAvatar: poses of another identity": poses(_other_shape),
    "SplattingAvatar: `--shape zero` beside poses with an identity": head_given(shape=Path("zero")),
    "SplattingAvatar: poses of another take": poses(_moved_poses),
    "SplattingAvatar: the newest iteration lacks embedding.json": run(_without_embedding),
    "SplattingAvatar: the newest iteration is an empty folder": run(_only_a_folder),
    "SplattingAvatar: a generic rig, embedding.obj in centimetres": run(obj(_times(100.0)), "body"),
    "LAM: offsets in millimetres": lam_offsets(1000.0),
}
