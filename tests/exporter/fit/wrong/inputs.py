"""Sound inputs of each system, and ways to change one file of them. Nothing here knows how mistakes are found.

The small samples hold random opacities and colours where only a training gives them sense: runs are written anew from
the trained samples, and the small checkpoint of Gaussian Blendshapes takes what the nearest trained Gaussians have.
"""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData
from samples.systems.ply import ply_bytes, splat_columns
from samples.systems.splatting_avatar import Embedded
from samples.systems.splatting_avatar_files import save_run

from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.driving.arkit import ARKIT_NAMES
from tests.exporter.fit.misfits import Bases, Given, blendshapes, head
from tests.exporter.glb_files import edited

TRAINED = Path(__file__).parents[4] / "samples" / "trained"
ITERATION = 30000
Change = Callable[[Any], Any]
Arrays = dict[str, Any]
# of a dump of Gaussian Blendshapes
STATIC = {"scale": "scale", "opacity": "opacity", "dc": "shs", "rot": "rot"}
Make = Callable[["Inputs", Path], Given]


@dataclass(frozen=True)
class Inputs:
    """Sound inputs: the small samples, and runs of trained samples."""

    bases: Bases
    blendshapes: Given  # Gaussian Blendshapes
    head: Given  # SplattingAvatar, small, with body model and tracked poses
    trained: Given  # SplattingAvatar, trained
    body: Given  # SplattingAvatar, trained
    points: Given  # PSAvatar, trained
    rigged: Given  # PSAvatar, small, on a body model
    lam: Given

    @staticmethod
    def make(folder: Path, bases: Bases | None = None) -> Inputs:
        """All of them, in `folder`."""
        bases = bases or Bases.make(folder / "bases")
        model, options = blendshapes(bases)
        copy = folder / "blendshapes" / model.name
        shutil.copytree(model, copy, ignore=shutil.ignore_patterns("*.pth", "acc*"))
        _take_trained(copy / "fix_chkpnt40000", load(TRAINED / "head_blendshapes"))
        alone = {"no_rig": True}
        runs = {name: folder / name for name in ("head_splatting", "body_splatting", "head_points")}
        for name, run in runs.items():
            (_points_run if name == "head_points" else _run)(load(TRAINED / name), run)
        body = bases.head / "body" / "body_model.npz"
        _small_points(body, folder / "small_points")
        return Inputs(
            bases,
            (copy, options),
            head(bases, "body_model", "poses"),
            (runs["head_splatting"], alone),
            (runs["body_splatting"], alone),
            (runs["head_points"], alone),
            (folder / "small_points", {"body_model": body, "shape": Path("zero")}),
            (bases.lam, {}),
        )


def _take_trained(folder: Path, trained: Avatar) -> None:
    """Opacities and colours of the nearest trained Gaussians."""
    places, g = np.load(folder / "pos.npy"), trained.gaussians
    near = [int(np.argmin(np.square(g.mean - place).sum(axis=1))) for place in places]
    np.save(folder / "opacity.npy", g.opacity_logit[near].reshape(np.load(folder / "opacity.npy").shape))
    colours = np.load(folder / "shs.npy")
    colours[:, 0] = g.sh[near, 0]
    np.save(folder / "shs.npy", colours)


def _embedded(avatar: Avatar, units: float) -> Embedded:
    g, e = avatar.gaussians, avatar.embedding
    assert e is not None
    return Embedded(
        np.round(units * e.canonical_vertices.astype("f8"), 6), e.triangles.astype("i8"), e.triangle.astype("i8"),
        e.barycentric, units * e.displacement, e.local_quat_wxyz, g.log_scale + np.float32(np.log(units)),
        g.opacity_logit, g.sh,
    )  # fmt: skip


def _run(avatar: Avatar, run: Path) -> None:
    """A SplattingAvatar run of a trained bundle."""
    heads = avatar.training_per_bundle != 1
    trained = _embedded(avatar, avatar.training_per_bundle)
    save_run(trained, run, mesh_scaling=heads, frames="imavatar" if heads else "peoplesnapshot")


def _points_run(avatar: Avatar, run: Path) -> None:
    """A PSAvatar run of a trained bundle, without what it learned for the mesh."""
    g, e = avatar.gaussians, avatar.embedding
    assert e is not None
    columns = splat_columns(g.mean, g.sh[:, 0], g.opacity_logit, g.log_scale, g.quat_wxyz)
    where = (e.triangle, e.barycentric, e.displacement, e.local_quat_wxyz)
    _save_points(run, columns, e.canonical_vertices, e.triangles, *where, avatar.training_per_bundle)


def _small_points(body: Path, run: Path) -> None:
    """A PSAvatar run on the template of a body model."""
    with np.load(body) as file:
        vertices, triangles = file["v_template"], file["faces"]
    rng, count = np.random.default_rng(5), 1500
    triangle, weights = rng.integers(0, len(triangles), count), rng.dirichlet([1, 1, 1], count).astype("f4")
    mean = np.einsum("nk,nkx->nx", weights, vertices[triangles[triangle]])
    quat, still = rng.normal(0, 1, (count, 4)).astype("f4"), np.zeros(count, "f4")
    scale, opacity = rng.normal(-5.5, 0.4, (count, 3)), rng.normal(1, 2, count)
    columns = splat_columns(mean, np.sin(20 * mean), opacity, scale, quat)
    _save_points(run, columns, vertices, triangles, triangle, weights, still, quat, 1.0)


def _save_points(run: Path, columns: Any, vertices: Any, triangles: Any, *where: Any) -> None:
    folder = run / "point_cloud" / f"iteration_{ITERATION}"
    folder.mkdir(parents=True)
    (folder / "point_cloud.ply").write_bytes(ply_bytes(columns))
    triangle, barycentric, displacement, local_quat_wxyz, units = where
    np.savez(
        folder / "psavatar.npz", canonical_vertices=vertices, triangles=triangles.astype("i4"),
        triangle=triangle.astype("i4"), barycentric=barycentric, displacement=displacement,
        local_quat_wxyz=local_quat_wxyz, basis=np.zeros((0, *vertices.shape), "f4"),
        basis_names=np.array([], "U1"), training_per_metre=np.array([units], "f4"),
    )  # fmt: skip


# --- changes of one file -------------------------------------------------------------------------------------------


def folder_of(system: str, change: Callable[[Path], object]) -> Make:
    """A copy of a model or run, or a LAM zip unpacked, changed."""

    def make(inputs: Inputs, folder: Path) -> Given:
        source, options = getattr(inputs, system)
        copy = folder / source.stem
        if source.suffix == ".zip":
            with zipfile.ZipFile(source) as archive:
                archive.extractall(folder)
        else:
            shutil.copytree(source, copy)
        change(copy)
        return copy, options

    return make


def splats(system: str, name: str, change: Change) -> Make:
    """Other values of scale [N, 3], opacity [N], dc [N, 3] or rot [N, 4], as the system's file has them."""

    def edit(folder: Path) -> None:
        if system == "blendshapes":
            path = next(folder.glob("fix_chkpnt*")) / f"{STATIC[name]}.npy"
            values = np.load(path)
            part = values[:, 0] if name in ("dc", "opacity") else values
            part[:] = change(part.copy())
            np.save(path, values)
            return
        path = next(p for p in folder.rglob("*.ply"))
        ply = PlyData.read(io.BytesIO(path.read_bytes()))
        rows = ply["vertex"].data
        columns = ["opacity"] if name == "opacity" else [
            c for c in rows.dtype.names if c.startswith({"dc": "f_dc", "scale": "scale", "rot": "rot"}[name])
        ]  # fmt: skip
        old = np.stack([rows[column] for column in columns], axis=1)
        new = change(old[:, 0].copy() if name == "opacity" else old.copy()).reshape(old.shape)
        for column, values in zip(columns, new.T, strict=True):
            rows[column] = values
        ply.write(str(path))
        if name == "rot" and system != "lam":
            embedded(system, "rotation", change)(folder)

    return folder_of(system, edit)


KEYS = {  # of embedding.json, of psavatar.npz
    "triangle": ("sample_fidxs", "triangle"),
    "barycentric": ("sample_bary", "barycentric"),
    "rotation": ("_rotation", "local_quat_wxyz"),
    "displacement": ("_xyz", "displacement"),  # the third of three columns
}


def embedded(system: str, name: str, change: Change) -> Callable[[Path], None]:
    """Edits an array of the embedding."""

    def edit(folder: Path) -> None:
        if system == "points":
            path = next(folder.rglob("psavatar.npz"))
            with np.load(path) as file:
                arrays = dict(file)
            key = KEYS[name][1]
            np.savez(path, **arrays | {key: change(arrays[key].copy())})
            return
        path = next(folder.rglob("embedding.json"))
        document = json.loads(path.read_text())
        key = KEYS[name][0]
        values = np.array(document[key])
        part = values[:, 2] if name == "displacement" else values
        part[:] = change(part.copy())
        document[key] = values.tolist()
        path.write_text(json.dumps(document))

    return edit


def body_model(system: str, change: Callable[[Arrays], object]) -> Make:
    """Another body model file."""

    def make(inputs: Inputs, folder: Path) -> Given:
        source, options = getattr(inputs, system)
        with np.load(options["body_model"]) as file:
            arrays = dict(file)
        change(arrays)
        np.savez(folder / "body_model.npz", **arrays)
        return source, options | {"body_model": folder / "body_model.npz"}

    return make


def skin_glb(change: Callable[[Any], object]) -> Make:
    """Another JSON part of the skin.glb of a LAM avatar."""

    def edit(folder: Path) -> None:
        path = next(folder.rglob("skin.glb"))
        path.write_bytes(edited(path.read_bytes(), change))

    return folder_of("lam", edit)


def with_option(system: str, **files: Callable[[Path], Any]) -> Make:
    """Further options, whose files are made in the folder."""

    def make(inputs: Inputs, folder: Path) -> Given:
        source, options = getattr(inputs, system)
        return source, options | {name: write(folder) for name, write in files.items()}

    return make


def clip_of(weights: Any) -> Callable[[Path], tuple[Path]]:
    """Writes a clip of ARKit's expressions over time [T, 52], as LAM has it."""

    def write(folder: Path) -> tuple[Path]:
        frames = [{"weights": row} for row in weights.tolist()]
        metadata = {"fps": 30, "frame_count": len(frames)}
        document = {"names": list(ARKIT_NAMES), "metadata": metadata, "frames": frames}
        (folder / "bsData.json").write_text(json.dumps(document))
        return (folder / "bsData.json",)

    return write


def rows_of(systems: Sequence[str], name: str, change: Change, shares: Sequence[float]) -> dict[str, Make]:
    """`splats` of each system, changed in each share of the rows."""
    return {
        f"{system}, {share:.0%} of the rows": splats(system, name, of_rows(change, share))
        for system in systems
        for share in shares
    }


def of_rows(change: Change, share: float) -> Change:
    """`change` of a part of the rows, picked at random."""

    def part(values: Any) -> Any:
        rows = np.random.default_rng(7).random(len(values)) < share
        changed = values.copy()
        changed[rows] = change(values[rows])
        return changed

    return change if share == 1 else part
