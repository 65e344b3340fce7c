"""3D Gaussian Blendshapes (zjumsj/GaussianBlendshapes 2952da7).

Either the folders that its test.py dumps (deltas already masked, init terms added) or the raw checkpoint
(positional tuples, masks and init terms beside them). Everything is read by blocks of Gaussians, so that memory
holds the sparse result only.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.bodies.body_model import BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.inputs import Inputs, find_inputs
from avatar_export.bodies.subject_files import read_eyelids, read_faces, read_shape
from avatar_export.driving.arkit import canonical
from avatar_export.formats.point_cloud import first_file
from avatar_export.options import ReadOptions
from avatar_export.provenance import source_files
from avatar_export.readers.gaussian_blendshapes import sources
from avatar_export.readers.gaussian_blendshapes.sources import FaceSource, Model, MouthSource
from avatar_export.readers.rules_file import RULES_FILE, TrainedRules, read_rules
from avatar_export.sparse import SparseRowsBuilder
from avatar_runtime.avatar import (
    F32,
    Avatar,
    Blendshapes,
    Driving,
    Expression,
    Gaussians,
    Group,
    RasterSettings,
    Rig,
    Rules,
    SparseRows,
)
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.rules import ANCHOR_RULES

SYSTEM = "gaussian_blendshapes"
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
    *("no_rig", "exact", "name"),
)
EYELIDS = ("left", "right")
JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
LOWER_TEETH = {  # rule of rules.json -> factors of joints; what is missing to 1 stays on the identity
    "mix": {"root": 0.0130787707, "neck": 0.0426467828, "jaw": 0.944269622},  # FLAME/lbs.py:240
    "jaw": {"jaw": 1.0},
}
PLAYED_RULES = {"anchor": ANCHOR_RULES, "lower_teeth": tuple(LOWER_TEETH)}
RECORDED_RULES = {
    "mask": ("fixed", "per_blendshape"),
    "init_position": ("affine", "rotation"),
    "init_sh": ("zero", "rotated"),
    "weights": ("nearest_triangle", "grid"),
    "consistency": ("all", "position", "none"),
    "deltas": ("trained", "fixed"),
    "mouth": ("on", "off"),
}
BLOCK = 512  # Gaussians at a time: 5 MB of SH deltas
# Below these a delta is rounding noise of the init terms ((Q - I) x0 + t in float32): it is dropped.
THRESHOLD = {"mean": 1e-8, "quat_wxyz": 1e-8, "log_scale": 1e-7, "opacity_logit": 1e-7, "sh": 1e-7}
FEATURES = 36


def detect(path: Path) -> bool:
    """Whether `path` is a model folder, a dump folder or a checkpoint of this system."""
    return sources.locate(path) is not None


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError for missing inputs, and for data that is not what it claims.

    Rows that hold a NaN in any field are dropped and listed (the system's own dump drops those with a NaN in
    position or SH; real checkpoints have them).
    """
    model = sources.locate(path)
    if model is None:
        raise AvatarError("holds no fix_chkpnt*/ folder and no fix_chkpnt*.pth", file=path, owner=SYSTEM)
    options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such choice or input")
    trained = read_rules(first_file([model.folder / RULES_FILE]), SYSTEM, PLAYED_RULES, RECORDED_RULES)
    face, mouths = sources.open_face(model), sources.open_mouths(model)
    inputs = find_inputs(model.folder, options, SYSTEM)
    body = _body(inputs, options, bool(mouths))
    names = _expression_names(body, face.expressions)
    parts = _Parts(face, mouths, len(names), options)
    kept = parts.read_face(face)
    for mouth in mouths:
        parts.read_mouth(mouth)
    rig = None if body is None else _rig(body, inputs, len(names))
    gaussians, blendshapes, skin = parts.finish(rig is not None)
    return Avatar(
        name=options.name or model.folder.resolve().name,
        gaussians=gaussians,
        groups=_groups(len(kept), mouths, rig is not None, trained.played.get("lower_teeth", "mix")),
        rules=Rules(
            rotation="polar3",
            sh_direction="inverse_rotation",
            anchor=trained.played.get("anchor", "repeats"),
        ),
        expressions=tuple(Expression(name, range=_range(name)) for name in names),
        late_morph_names=EYELIDS,
        blendshapes=blendshapes,
        skin=skin,
        rig=rig,
        sh_degree=face.sh_degree,
        driving=_driving(names, rig),
        raster=RasterSettings(near=0.2 / options.body_scale, background=_background(model.folder)),
        head_pose_in="camera",
        training_per_bundle=options.body_scale,
        delta_threshold=parts.threshold,
        provenance=_provenance(model, face, kept, inputs, body, trained),
    )


class _Parts:
    """Collects groups into one set of arrays."""

    def __init__(
        self, face: FaceSource, mouths: list[MouthSource], columns: int, options: ReadOptions
    ) -> None:
        self.unit = np.float32(1 / options.body_scale)
        self.coefficients = face.coefficients
        self.threshold = dict.fromkeys(THRESHOLD, 0.0) if options.exact else dict(THRESHOLD)
        rows = face.count + sum(m.count for m in mouths)
        t = self.threshold
        self.static: list[dict[str, F32]] = []
        self.builders = {
            "geometry": SparseRowsBuilder(
                rows,
                columns,
                {"mean": (3,), "quat_wxyz": (4,)},
                {"mean": t["mean"], "quat_wxyz": t["quat_wxyz"]},
            ),
            "appearance": SparseRowsBuilder(
                rows,
                columns,
                {"log_scale": (3,), "opacity_logit": (), "sh": (face.coefficients, 3)},
                {name: t[name] for name in ("log_scale", "opacity_logit", "sh")},
            ),
            "correctives": SparseRowsBuilder(rows, FEATURES, {"mean": (3,)}, {"mean": 0.0}),
            "late_morphs": SparseRowsBuilder(rows, len(EYELIDS), {"mean": (3,)}, {"mean": 0.0}),
            "skin": SparseRowsBuilder(rows, len(JOINTS), {"weight": ()}, {"weight": 0.0}),
        }

    def read_face(self, face: FaceSource) -> np.ndarray[Any, np.dtype[np.int64]]:
        """Rows kept, in terms of the file's rows."""
        kept = []
        for start in range(0, face.count, BLOCK):
            block = face.block(start, min(start + BLOCK, face.count))
            finite = _finite_rows(block)
            kept.append(start + np.flatnonzero(finite))
            if not finite.all():
                block = {part: {k: v[finite] for k, v in values.items()} for part, values in block.items()}
            self._append(block)
        rows = np.concatenate(kept)
        if not len(rows):
            raise AvatarError("every row holds a NaN", file=face.file, owner=SYSTEM)
        return rows

    def read_mouth(self, mouth: MouthSource) -> None:
        """Teeth: static Gaussians, no deltas of their own."""
        stored, needed = mouth.static["sh"].shape[1], self.coefficients
        if stored != needed:
            raise AvatarError(
                f"has {stored} SH coefficients, the face {needed}", file=mouth.file, owner=SYSTEM
            )
        finite = np.logical_and.reduce(
            [np.isfinite(v.reshape(mouth.count, -1)).all(axis=1) for v in mouth.static.values()]
        )
        if not finite.all():
            raise AvatarError(
                f"row {int(np.argmin(finite))} holds a NaN; teeth have none in this system",
                file=mouth.file,
                owner=SYSTEM,
            )
        self._append({"static": mouth.static})

    def finish(self, rigged: bool) -> tuple[Gaussians, Blendshapes, SparseRows]:
        static = {name: np.concatenate([part[name] for part in self.static]) for name in self.static[0]}
        n = len(static["mean"])
        parts = {name: builder.finish() for name, builder in self.builders.items()}
        if not rigged:
            parts["correctives"] = SparseRows.empty(n, 0, {"mean": (3,)})
            parts["skin"] = SparseRows.empty(n, 0, {"weight": ()})
        skin = parts.pop("skin")
        return Gaussians(**static), Blendshapes(**parts), skin

    def _append(self, block: Mapping[str, Mapping[str, F32]]) -> None:
        static = dict(block["static"])
        static["mean"] = static["mean"] * self.unit
        static["log_scale"] = static["log_scale"] + np.log(self.unit)
        self.static.append(static)
        count = len(static["mean"])
        for name, builder in self.builders.items():
            if name in block:
                values = dict(block[name])
                if "mean" in values:
                    values["mean"] = values["mean"] * self.unit
                builder.append(values)
            else:
                builder.append_empty(count)


def _finite_rows(block: Mapping[str, Mapping[str, F32]]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    count = len(block["static"]["mean"])
    finite = np.ones(count, bool)
    for values in block.values():
        for value in values.values():
            with np.errstate(invalid="ignore"):  # inf - inf
                total = np.sum(value, dtype=np.float64)
            if not np.isfinite(total):
                finite &= np.isfinite(value.reshape(count, -1)).all(axis=1)
    return finite


def _body(inputs: Inputs, options: ReadOptions, mouths: bool) -> BodyModel | None:
    """The body model, once everything that belongs to it is there: what is missing is said in one go."""
    if options.no_rig:
        return None
    missing = []
    body = None if inputs.body_model is None else read_body_model(inputs.body_model)
    if body is None:
        missing.append("--body-model (FLAME layout, .npz or .pkl)")
    elif tuple(body.joint_names) != JOINTS:
        raise AvatarError(
            f"has joints {', '.join(body.joint_names)[:80]}; this system is trained on {', '.join(JOINTS)}",
            file=inputs.body_model,
            owner=SYSTEM,
        )
    if inputs.shape is None and (body is None or body.identity_dirs.shape[2]):
        missing.append("--shape (the subject's identity: a tracked .frame, .npy, .npz, .json, or `zero`)")
    if mouths and inputs.anchor_faces is None:
        missing.append("--anchor-faces (back_of_head.txt of the release, which carries the upper teeth)")
    if body is None or missing:
        raise AvatarError(
            f"a checkpoint of this system does not hold its rig; pass {' and '.join(missing)}, or --dataset FOLDER "
            "that holds them, or --no-rig for expressions alone, without jaw, eyes and moving teeth",
            owner=SYSTEM,
        )
    return body


def _rig(body: BodyModel, inputs: Inputs, expressions: int) -> Rig:
    shape = None if inputs.shape is None or str(inputs.shape) == "zero" else read_shape(inputs.shape)
    faces = None if inputs.anchor_faces is None else read_faces(inputs.anchor_faces, len(body.triangles))
    rig = bake_rig(body, shape, _mesh_eyelids(body, inputs), faces)
    if rig.joint_basis.shape[0] != expressions:
        raise AvatarError(
            f"the checkpoint has {expressions} expressions, the body model {rig.joint_basis.shape[0]}",
            owner=SYSTEM,
        )
    return rig


def _mesh_eyelids(body: BodyModel, inputs: Inputs) -> dict[str, F32]:
    """Zero where no files are given: the Gaussians' own eyelids come with the checkpoint."""
    if inputs.eyelids is None:
        return {name: np.zeros((body.vertex_count, 3), np.float32) for name in EYELIDS}
    return read_eyelids(inputs.eyelids, body.vertex_count)


def _expression_names(body: BodyModel | None, gaussian_expressions: int) -> list[str]:
    """The body model's names; it may have more expressions than the Gaussians (they move mesh and joints)."""
    if body is None:
        return [f"exp_{k:03d}" for k in range(gaussian_expressions)]
    count = body.expression_dirs.shape[2]
    return list(body.expression_names or (f"exp_{k:03d}" for k in range(max(count, gaussian_expressions))))


def _range(name: str) -> tuple[float, float]:
    """ARKit weights are 0..1; coefficients of a statistical basis are standard deviations."""
    return (0.0, 1.0) if canonical(name) else (-2.0, 2.0)


def _groups(face: int, mouths: list[MouthSource], rigged: bool, lower_teeth: str) -> tuple[Group, ...]:
    """Draw order of the system: face, upper teeth, lower teeth (ties in depth go by row)."""
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
    """The training background: cfg_args says white_bkgd (a text; it is searched, never evaluated)."""
    try:
        with open_file(folder / "cfg_args") as file:
            text = file.read(100_000).decode("utf-8", errors="replace")
    except OSError:
        text = ""
    white = re.search(r"\bwhite_bkgd=True\b", text) is not None
    return (1.0, 1.0, 1.0) if white else (0.0, 0.0, 0.0)


def _notes(inputs: Inputs, body: BodyModel | None, trained: TrainedRules) -> list[str]:
    notes = [f"{name} {value} ({RULES_FILE})" for name, value in trained.played.items()] + trained.notes()
    if body is not None and inputs.eyelids is None:
        notes.append("no eyelid files (--eyelids): the Gaussians' lids close, those of the rig's mesh do not")
    return notes


def _provenance(
    model: Model,
    face: FaceSource,
    kept: np.ndarray[Any, Any],
    inputs: Inputs,
    body: BodyModel | None,
    trained: TrainedRules,
) -> dict[str, Any]:
    files = {**sources.model_files(model), **inputs.files()}
    files |= {} if trained.file is None else {RULES_FILE: trained.file}
    dropped = np.setdiff1d(np.arange(face.count), kept)
    return {
        "system": SYSTEM,
        "source_commit": "zjumsj/GaussianBlendshapes 2952da7",
        "form": face.form,
        "face_rows_read": face.count,
        "face_rows_dropped": [int(row) for row in dropped],
        "source_files": source_files(files),
        "notes": _notes(inputs, body, trained),
        "body_model_restriction": None
        if body is None
        else "the rig derives from the body model given; its licence goes with this bundle",
    }
