"""The files of a Gaussian Blendshapes model on disk: where they lie, and the names and shapes of their arrays."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from avatar_runtime.io.errors import AvatarError

SYSTEM = "gaussian_blendshapes"
EYELIDS = ("left", "right")
JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")

# Items of the raw face checkpoint, face_gs_model.py:118-140.
FACE_TUPLE = {
    "xyz": 1,
    "features_dc": 2,
    "features_rest": 3,
    "scaling": 4,
    "rotation": 5,
    "opacity": 6,
    "xyz_b": 10,
    "features_b": 11,
    "scaling_b": 12,
    "rotation_b": 13,
    "opacity_b": 14,
}
FACE_TUPLE_LENGTH, MOUTH_TUPLE_LENGTH = 19, 12
ACC_KEYS = ("init_rot", "init_sh", "init_xyz", "pose_blendshape", "eye_blendshape", "expr_mask_tensor", "W")
MOST_NAMED = 3  # files in a message
MOUTHS = (("mouth0", "upper_teeth", "anchor"), ("mouth1", "lower_teeth", "joint_mix"))

# Shapes by field; P rows, C coefficients, K expressions.
DUMP_SHAPES: dict[str, tuple[object, ...]] = {
    "pos": ("P", 3),
    "shs": ("P", "C", 3),
    "scale": ("P", 3),
    "rot": ("P", 4),
    "opacity": ("P", 1),
    "xyz_t": ("P", 3, "K"),
    "shs_t": ("P", "C", 3, "K"),
    "scale_t": ("P", 3, "K"),
    "rot_t": ("P", 4, "K"),
    "opacity_t": ("P", 1, "K"),
    "pos_t": (36, "P", 3),
    "W": ("P", 5),
    "eyelid": ("P", 3, 2),
}
MOUTH_FIELDS = ("pos", "shs", "scale", "rot", "opacity")
RAW_SHAPES: dict[str, tuple[object, ...]] = {
    "xyz": ("P", 3),
    "features_dc": ("P", 1, 3),
    "features_rest": ("P", "C - 1", 3),
    "scaling": ("P", 3),
    "rotation": ("P", 4),
    "opacity": ("P", 1),
    "xyz_b": ("P", 3, "K"),
    "features_b": ("P", "C", 3, "K"),
    "scaling_b": ("P", 3, "K"),
    "rotation_b": ("P", 4, "K"),
    "opacity_b": ("P", 1, "K"),
    "init_xyz": ("P", 3, "K"),
    "init_rot": ("P", 4, "K"),
    "init_sh": ("P", "C", 3, "K"),
    "pose_blendshape": (36, "P", 3),
    "eye_blendshape": ("P", 3, 2),
    "expr_mask_tensor": ("P", "K"),
    "W": ("P", 5),
}


@dataclass(frozen=True)
class Model:
    """The files of one iteration of a model, in form `dump` or `raw`."""

    folder: Path
    iteration: str
    form: str  # "dump" | "raw"
    face: Path


def locate(path: Path) -> Model | None:
    """The latest iteration under `path` (a model folder, its dump folder or its fix_chkpnt*.pth).

    If both forms exist, the dump is chosen: it already contains init terms and masks. Pass the .pth to choose the raw
    form.
    """
    if path.is_file():
        found = _iteration(path, ".pth")
        return Model(path.parent, found, "raw", path) if found is not None else None
    if not path.is_dir():
        return None
    here = _iteration(path, "")
    if here is not None and (path / "xyz_t.npy").is_file():
        return Model(path.parent, here, "dump", path)
    return next(iter(models(path)), None)


def models(folder: Path) -> list[Model]:
    """Every iteration in a model folder, the newest first, and of each the dump before the raw form."""
    candidates = []
    for entry in sorted(folder.iterdir()):
        dump, raw = _iteration(entry, ""), _iteration(entry, ".pth")
        if dump is not None and (entry / "xyz_t.npy").is_file():
            candidates.append((int(dump), 1, Model(folder, dump, "dump", entry)))
        if raw is not None and entry.is_file():
            candidates.append((int(raw), 0, Model(folder, raw, "raw", entry)))
    return [c[2] for c in sorted(candidates, key=lambda c: c[:2], reverse=True)]


def refuse_incomplete(model: Model, accept: bool) -> None:
    """Raise AvatarError if `model` lacks files that another iteration has; the newest complete one is named.

    `accept` teeth that are missing: training may have removed their last Gaussian."""
    lacking, others = missing(model), models(model.folder)
    complete = next((m for m in others if m.iteration != model.iteration and not missing(m)), None)
    mouths = any(stem in name for name in lacking for stem, _, _ in MOUTHS)
    if not lacking or (complete is None and not mouths) or (mouths and accept):
        return  # the reader names the file
    offered = "no iteration is complete" if complete is None else (
        f"the newest complete iteration is {complete.iteration}: pass {complete.face}"
    )  # fmt: skip
    named = " and no ".join(lacking[:MOST_NAMED])
    if len(lacking) > MOST_NAMED:
        named += f" ({len(lacking)} files are missing)"
    there = sorted(path.name for path in model.folder.glob("mouth[01]_chkpnt*")) if mouths else []
    if there:
        named += f", only {' and '.join(there[:MOST_NAMED])}"
        offered += "; --accept-misfit converts it without these teeth"
    raise AvatarError(
        f"iteration {model.iteration} is incomplete: there is no {named}; {offered}",
        file=model.folder,
        owner=SYSTEM,
    )


def missing(model: Model) -> list[str]:
    """Names of files that this iteration lacks; teeth only where another iteration has them."""
    paths = [model.folder / f"acc{model.iteration}.npy"] if model.form == "raw" else []
    paths += [model.face / f"{name}.npy" for name in DUMP_SHAPES] if model.form == "dump" else []
    lacking = [path.relative_to(model.folder).as_posix() for path in paths if not path.exists()]
    there = {path.name.split("_")[0] for path, _, _ in mouth_paths(model)}
    return lacking + [
        f"{stem}_chkpnt{model.iteration}"
        for stem, _, _ in MOUTHS
        if stem not in there and any(model.folder.glob(f"{stem}_chkpnt*"))
    ]


def model_files(model: Model) -> dict[str, Path]:
    """Every file of the model that is read, by its path in the model folder."""
    paths = [path for path, _, _ in mouth_paths(model)] + [model.face]
    if model.form == "raw":
        paths.append(model.folder / f"acc{model.iteration}.npy")
    files = []
    for path in paths:
        fields = DUMP_SHAPES if path == model.face else MOUTH_FIELDS
        files += [path / f"{name}.npy" for name in fields] if path.suffix == "" else [path]
    return {file.relative_to(model.folder).as_posix(): file for file in files}


def mouth_paths(model: Model) -> list[tuple[Path, str, str]]:
    """(folder or .pth, group, binding); for a dump its folder comes first."""
    suffixes = ("", ".pth") if model.form == "dump" else (".pth",)
    found = []
    for stem, name, binding in MOUTHS:
        paths = [model.folder / f"{stem}_chkpnt{model.iteration}{suffix}" for suffix in suffixes]
        found += [(path, name, binding) for path in paths if path.is_dir() or path.is_file()][:1]
    return found


def _iteration(path: Path, suffix: str) -> str | None:
    match = re.fullmatch(r"fix_chkpnt(\d{1,12})" + re.escape(suffix), path.name)
    return match.group(1) if match else None
