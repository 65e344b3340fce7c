"""Build sample checkpoints: `python -m samples.make OUT`. Deterministic, offline, no torch."""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import FEATURES, BodyModel, Head, build_body_model, driving, save_body
from samples.subjects.body import PATH as BODY_RIG
from samples.subjects.body import load_body
from samples.subjects.body_files import save_flame_pickle, save_tracked_frame
from samples.subjects.head import load_head, simplify
from samples.subjects.take import load_take, save_flame_params
from samples.systems.gaussian_blendshapes import build_model
from samples.systems.gaussian_blendshapes_files import save_cfg_args, save_dump, save_raw
from samples.systems.lam import NAME as LAM_NAME
from samples.systems.lam import build_lam, save_lam
from samples.systems.lhm import save_lhm
from samples.systems.rgbavatar import save_rgbavatar, uv_corners
from samples.systems.splatting_avatar_files import save_run
from samples.systems.splatting_body import build_walker
from samples.systems.splatting_head import UNITS_PER_METRE, build_head

Array = npt.NDArray[Any]

DEMO_GAUSSIANS = 20000
BODY_GAUSSIANS = 18000
RGB_GAUSSIANS = 36_000  # at least: a deep network has 35,732 parameters, one a row
CONFORMANCE_GAUSSIANS = 1500
CONFORMANCE_CELL = 0.008  # metres between vertices of the conformance avatars' mesh
SEED = 2024
FORMS = ("dump", "raw", "both")


def smooth_posedirs(head: Head, rng: np.random.Generator) -> Array:
    """Random pose correctives [V, 3, 36] that vary slowly over the head, up to about a millimetre."""
    wave = rng.normal(0, 25, (3, FEATURES))
    phase = rng.uniform(0, 2 * np.pi, FEATURES)
    size = rng.normal(0, 4e-4, (3, FEATURES))
    posedirs: Array = np.sin(head.vertices @ wave + phase)[:, None, :] * size
    return posedirs


def subject(full: bool, cell: float = CONFORMANCE_CELL) -> tuple[Head, BodyModel, Array]:
    """The head, its body model and its identity; `full`: coarse, with pose correctives and a seeded identity.

    cell: metres between the vertices of a coarse mesh.
    """
    head, rng = load_head(), np.random.default_rng(SEED)
    if full:
        head = simplify(head, cell)
    posedirs = smooth_posedirs(head, rng) if full else None
    shape = rng.normal(0, 0.7, len(head.identity)) if full else np.zeros(len(head.identity))
    return head, build_body_model(head, moving_joints=full, posedirs=posedirs), shape


def make_gaussian_blendshapes(
    out: Path,
    gaussians: int | None = None,
    *,
    form: str = "dump",
    full: bool = False,
    cell: float = CONFORMANCE_CELL,
) -> Path:
    """Write model/, body/, dataset/ and driving.json into out/gaussian_blendshapes; returns that folder.

    `full`: the conformance avatar, a coarse head with seeded random values in every field, an identity shape,
    and NaN rows in the raw form; its body also as FLAME's pickle. cell: metres between the vertices of its mesh.
    """
    if form not in FORMS:
        raise ValueError(f"form is one of {FORMS}, not {form!r}")
    head, body, shape = subject(full, cell)
    count = gaussians or (CONFORMANCE_GAUSSIANS if full else DEMO_GAUSSIANS)
    model = build_model(head, body, count, shape=shape, noise_seed=SEED if full else None)
    base = out / "gaussian_blendshapes"
    save_cfg_args(base / "model")
    if form != "raw":
        save_dump(model, base / "model")
    if form != "dump":
        save_raw(model, base / "model")
    save_body(body, shape, base / "body")
    save_tracked_frame(shape, base / "dataset" / "checkpoint" / "00000.frame")
    if full:
        save_flame_pickle(body, base / "body" / "flame_layout_model.pkl")
    save_driving(head, body, base / "driving.json")
    return base


def save_driving(head: Head, body: BodyModel, path: Path) -> None:
    """The matrix from ARKit weights to expressions, jaw and eyes."""
    path.write_text(json.dumps(driving(body, head.expression_names), indent=1) + "\n")


def make_lam(out: Path, *, full: bool = False) -> Path:
    """Write out/lam/head.zip, one Gaussian a vertex; `full`: a coarse head with seeded random values."""
    head = load_head()
    if full:
        head = simplify(head, CONFORMANCE_CELL)
    path = out / "lam" / f"{LAM_NAME}.zip"
    save_lam(build_lam(head, SEED if full else None), path)
    return path


def make_splatting_head(
    out: Path, gaussians: int | None = None, *, sh_degree: int = 0, full: bool = False
) -> Path:
    """Write run/, body/, flame_params.json and driving.json into out/splatting_avatar/head; returns that folder.

    The embedding mesh is the first frame of flame_params.json, in metres times 4. `full`: the conformance
    avatar, a coarse head with an identity shape, pose correctives and random opacities and SH rest.
    """
    head, body, shape = subject(full)
    take = load_take(body, shape)
    count = gaussians or (CONFORMANCE_GAUSSIANS if full else DEMO_GAUSSIANS)
    trained = build_head(head, body, take, count, sh_degree, noise_seed=SEED if full else None)
    base = out / "splatting_avatar" / "head"
    save_run(trained, base / "run", mesh_scaling=True, frames="imavatar")
    save_body(body, np.zeros(0), base / "body")
    save_flame_params(take, base / "flame_params.json", UNITS_PER_METRE)
    save_driving(head, body, base / "driving.json")
    return base


def make_rgbavatar(out: Path, gaussians: int | None = None, *, deep: bool = True, full: bool = False) -> Path:
    """Write run/, body/, which holds the texture coordinates too, and flame_params.json into out/rgbavatar; returns it.

    `deep`: the network has hidden layers. `full`: a coarse head with an identity shape and pose correctives.
    """
    head, body, shape = subject(full)
    base = out / "rgbavatar"
    identity = np.tensordot(shape.astype(np.float32), head.identity, 1)
    save_rgbavatar(
        replace(head, vertices=head.vertices + identity), gaussians or RGB_GAUSSIANS, base / "run", deep=deep
    )
    save_body(body, shape, base / "body")
    with np.load(base / "body" / "body_model.npz") as stored:
        arrays = {name: stored[name] for name in stored.files}
    uv = uv_corners(head).reshape(-1, 2)
    arrays |= {"uvs": uv, "uv_faces": np.arange(len(uv)).reshape(-1, 3)}
    np.savez(base / "body" / "body_model.npz", **arrays)
    save_flame_params(load_take(body, shape), base / "flame_params.json", 1.0)
    return base


def make_lhm(out: Path, gaussians: int | None = None) -> Path:
    """Write man.ply, betas.npy and pretrained_models/ into out/lhm; returns that folder."""
    save_lhm(load_body(), gaussians or BODY_GAUSSIANS, out / "lhm")
    return out / "lhm"


def make_body(out: Path, gaussians: int | None = None) -> Path:
    """Write run/ and the rig CesiumMan.glb into out/splatting_avatar/body; returns that folder."""
    trained = build_walker(load_body(), gaussians or BODY_GAUSSIANS)
    base = out / "splatting_avatar" / "body"
    save_run(trained, base / "run", mesh_scaling=False, frames="peoplesnapshot")
    shutil.copyfile(BODY_RIG, base / BODY_RIG.name)
    return base


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m samples.make", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write into")
    parser.add_argument("--gaussians", type=int, help="how many (of Gaussian Blendshapes: in the face set)")
    parser.add_argument("--form", choices=FORMS, default="dump", help="Gaussian Blendshapes layout")
    parser.add_argument("--system", choices=(*SYSTEMS, "all"), default="all")
    parser.add_argument("--full", action="store_true", help="conformance avatars: no field is zero")
    args = parser.parse_args()
    for system, make in SYSTEMS.items():
        if args.system in (system, "all"):
            print(make(args))


SYSTEMS: dict[str, Callable[[argparse.Namespace], Path]] = {
    "gaussian_blendshapes": lambda a: make_gaussian_blendshapes(a.out, a.gaussians, form=a.form, full=a.full),
    "lam": lambda a: make_lam(a.out, full=a.full),
    "splatting_head": lambda a: make_splatting_head(
        a.out, a.gaussians, sh_degree=3 if a.full else 0, full=a.full
    ),
    "splatting_body": lambda a: make_body(a.out, a.gaussians),
    "lhm": lambda a: make_lhm(a.out, a.gaussians),
    "rgbavatar": lambda a: make_rgbavatar(a.out, max(a.gaussians or 0, RGB_GAUSSIANS), full=a.full),
}


if __name__ == "__main__":
    main()
