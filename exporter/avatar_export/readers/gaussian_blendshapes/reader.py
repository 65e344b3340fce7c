"""3D Gaussian Blendshapes (zjumsj/GaussianBlendshapes 2952da7).

Either the folders that its test.py dumps (deltas already masked, init terms added) or the raw checkpoint
(positional tuples, with masks and init terms beside them). Everything is read by blocks of Gaussians, so that only the
sparse result is kept in memory.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.bodies.body_model import BodyModel
from avatar_export.bodies.inputs import Inputs, find_inputs, found_file, passed_over
from avatar_export.formats.point_cloud import first_file
from avatar_export.notes.note import Note, Setting, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import body_restriction, source_files
from avatar_export.readers.gaussian_blendshapes import rig
from avatar_export.readers.gaussian_blendshapes.layout import (
    EYELIDS,
    JOINTS,
    SYSTEM,
    Model,
    locate,
    model_files,
    models,
    refuse_incomplete,
)
from avatar_export.readers.gaussian_blendshapes.parts import Parts
from avatar_export.readers.gaussian_blendshapes.sources import FaceSource, MouthSource, open_face, open_mouths
from avatar_export.readers.rules_file import RULES_FILE, TrainedRules, read_rules
from avatar_runtime.avatar import Avatar, Driving, Expression, Group, RasterSettings, Rig, Rules
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.rules import ANCHOR_RULES

FILES = (
    "fix_chkpnt*/ with pos, shs, scale, rot, opacity, *_t, W, eyelid .npy (written by its test.py)",
    "or fix_chkpnt*.pth with acc*.npy (the raw checkpoint)",
    "mouth0_* (upper teeth) and mouth1_* (lower teeth), as folders or .pth",
    f"{RULES_FILE} in the same folder (optional: rules of the paper in place of the released code's)",
    "beside it: body model (--body-model), identity (--shape), eyelids (--eyelids), anchor faces (--anchor-faces)",
)

WITHOUT_RIG = ReadOptions(no_rig=True)
USED_OPTIONS = (
    *("body_model", "body_scale", "shape", "eyelids", "anchor_faces", "dataset"),
    *("no_rig", "exact", "name", "accept_misfit"),
)
LOWER_TEETH = {  # rule of rules.json -> factors of joints; the remainder to 1 goes to the identity
    "mix": {"root": 0.0130787707, "neck": 0.0426467828, "jaw": 0.944269622},  # FLAME/lbs.py:240
    "jaw": {"jaw": 1.0},
}
PLAYED_RULES = {"anchor": ANCHOR_RULES, "lower_teeth": tuple(LOWER_TEETH)}
CONFIG = "cfg_args"
FORMS = {"dump": "the dump", "raw": "the raw checkpoint"}
RECORDED_RULES = {
    "mask": ("fixed", "per_blendshape"),
    "init_position": ("affine", "rotation"),
    "init_sh": ("zero", "rotated"),
    "weights": ("nearest_triangle", "grid"),
    "consistency": ("all", "position", "none"),
    "deltas": ("trained", "fixed"),
    "mouth": ("on", "off"),
}


def detect(path: Path) -> bool:
    """Whether `path` is a model folder, a dump folder or a checkpoint of this system; never raises."""
    return locate(path) is not None


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError for missing inputs and unsound data.

    Rows with a NaN in any field are dropped and listed in the provenance. Real checkpoints have such rows; the system's
    own dump drops those with a NaN in position or SH.
    """
    model = locate(path)
    if model is None:
        raise AvatarError("has no fix_chkpnt*/ folder and no fix_chkpnt*.pth", file=path, owner=SYSTEM)
    options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
    options.refuse_beside_no_rig(("body_model", "shape", "eyelids", "anchor_faces"), SYSTEM)
    refuse_incomplete(model, options.accept_misfit)
    trained = read_rules(first_file([model.folder / RULES_FILE]), SYSTEM, PLAYED_RULES, RECORDED_RULES)
    scale = options.body_scale or trained.units or 1.0
    face, mouths = open_face(model), open_mouths(model)
    inputs = find_inputs(model.folder, options, SYSTEM)
    body = rig.body_model(inputs, options, bool(mouths))
    names = _expression_names(body, face.expressions)
    parts = Parts(face, mouths, len(names), scale, options.exact)
    kept = parts.read_face(face)
    for mouth in mouths:
        parts.read_mouth(mouth)
    baked = None if body is None else rig.baked_rig(body, inputs, len(names))
    gaussians, blendshapes, skin = parts.finish(baked is not None)
    avatar = Avatar(
        name=options.name or model.folder.resolve().name,
        gaussians=gaussians,
        groups=_groups(len(kept), mouths, baked is not None, trained.played.get("lower_teeth", "mix")),
        rules=Rules(
            rotation="polar3", sh_direction="inverse_rotation", anchor=trained.played.get("anchor", "repeats")
        ),
        expressions=tuple(Expression(name, range=_range(name)) for name in names),
        eyelids=EYELIDS,
        blendshapes=blendshapes,
        skin=skin,
        rig=baked,
        sh_degree=face.sh_degree,
        driving=_driving(names, baked),
        raster=RasterSettings(near=0.2 / scale, background=_background(model.folder)),
        head_pose_in="camera",
        training_per_bundle=scale,
        delta_threshold=parts.threshold,
    )
    notes = [
        *_notes(inputs, body, trained),
        *([] if body is None else rig.fit_notes(avatar, body, inputs, options, model.folder)),
        *_assumed(model, trained.units, options),
        *_taken(path, model, options),
    ]
    return replace(avatar, provenance=_provenance(model, face, kept, inputs, body, trained, notes))


def _taken(path: Path, model: Model, options: ReadOptions) -> list[Note]:
    """The iteration and form that are read, the identity that was found, and what is passed over."""
    over = [other.face.name for other in models(model.folder) if other.face != model.face]
    notes = [_of_this_run(f"{FORMS[model.form]} {model.face.name}", over if path == model.folder else [])]
    if options.shape is None and options.dataset is not None and not options.no_rig:
        shape = found_file(options.dataset, "shape")
        others = [] if shape is None else passed_over(options.dataset, "shape", shape)
        if shape is not None and others:
            notes.append(_of_this_run(f"the identity of {shape.name}", [other.name for other in others]))
    return notes


def _of_this_run(what: str, others: list[str]) -> Note:
    return Note("taken", {"what": what, "others": others}, passing=True)


def _assumed(model: Model, units: float | None, options: ReadOptions) -> list[Note]:
    """The unit, and a background that nothing states."""
    settings = []
    if options.body_scale is None:
        source = RULES_FILE if units is not None else "assumed; --body-scale sets another number"
        settings.append(Setting("units", units or 1.0, source))
    elif units not in (None, options.body_scale):
        source = f"--body-scale; {RULES_FILE} says {units:g}"
        settings.append(Setting("units", options.body_scale, source))
    if first_file([model.folder / CONFIG]) is None:
        settings.append(Setting("background", "black", f"assumed; there is no {CONFIG} in the model folder"))
    return [Note("settings", {"settings": [one]}, passing=True) for one in settings]


def _expression_names(body: BodyModel | None, gaussian_expressions: int) -> list[str]:
    """The names of the body model's expressions; those that the Gaussians lack move only mesh and joints."""
    if body is None:
        return [f"exp_{k:03d}" for k in range(gaussian_expressions)]
    count = body.expression_dirs.shape[2]
    return list(body.expression_names or (f"exp_{k:03d}" for k in range(max(count, gaussian_expressions))))


def _range(name: str) -> tuple[float, float]:
    """The range of an expression: ARKit weights are 0..1, coefficients of a basis are standard deviations."""
    return (0.0, 1.0) if canonical(name) else (-2.0, 2.0)


def _groups(face: int, mouths: list[MouthSource], rigged: bool, lower_teeth: str) -> tuple[Group, ...]:
    """The groups in the draw order of the system: face, upper teeth, lower teeth (rows decide ties in depth)."""
    groups = [Group("face", 0, face, "skin" if rigged else "none")]
    for mouth in mouths:
        first = groups[-1].first + groups[-1].count
        mix = LOWER_TEETH[lower_teeth] if rigged and mouth.binding == "joint_mix" else {}
        groups.append(Group(mouth.name, first, mouth.count, mouth.binding if rigged else "none", mix))
    return tuple(groups)


def _driving(names: list[str], rig: Rig | None) -> Driving:
    named = sum(canonical(name) is not None for name in names)
    pivot = (0.0, 0.0, 0.0)
    if rig is not None:
        neck = -rig.inverse_bind_matrix[JOINTS.index("neck"), :3, 3]
        pivot = (float(neck[0]), float(neck[1]), float(neck[2]))
    return Driving(
        mode="names" if named >= len(names) // 2 else "none",
        head_pivot=pivot,
        left_eye_joint="leftEye" if rig else None,
        right_eye_joint="rightEye" if rig else None,
    )


def _background(folder: Path) -> tuple[float, float, float]:
    """The training background, white_bkgd in cfg_args (its text is searched, never evaluated)."""
    try:
        with open_file(folder / CONFIG) as file:
            text = file.read(100_000).decode("utf-8", errors="replace")
    except OSError:
        text = ""
    white = re.search(r"\bwhite_bkgd=True\b", text) is not None
    return (1.0, 1.0, 1.0) if white else (0.0, 0.0, 0.0)


def _notes(inputs: Inputs, body: BodyModel | None, trained: TrainedRules) -> list[Note]:
    played = (Setting(name, value, RULES_FILE) for name, value in trained.played.items())
    notes = [*(fact("settings", settings=[one]) for one in played), *trained.notes()]
    if body is not None and inputs.eyelids is None:
        notes.append(fact("no_mesh_eyelids"))
    return notes


def _provenance(
    model: Model,
    face: FaceSource,
    kept: np.ndarray[Any, Any],
    inputs: Inputs,
    body: BodyModel | None,
    trained: TrainedRules,
    notes: list[Note],
) -> dict[str, Any]:
    files = {**model_files(model), **inputs.files()}
    files |= {} if trained.file is None else {RULES_FILE: trained.file}
    dropped = np.setdiff1d(np.arange(face.count), kept)
    return {
        "system": SYSTEM,
        "source_commit": "zjumsj/GaussianBlendshapes 2952da7",
        "form": face.form,
        "face_rows_read": face.count,
        "face_rows_dropped": [int(row) for row in dropped],
        "source_files": source_files(files),
        "notes": notes,
        "body_model_restriction": None if body is None else body_restriction(body.licence),
    }
