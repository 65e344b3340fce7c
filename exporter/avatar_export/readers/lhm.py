"""LHM (aigc3d/LHM b31e76a): the .ply that it saves of a person, skinned by the joints of SMPL-X.

The file holds the Gaussians in the zero pose, with the person's shape. Each takes the skin weights and expressions of
the vertex of SMPL-X that is nearest to its sampled point on the template; the points lie in the release's folder, row
by row as the Gaussians. The .ply is like any other, so `--system lhm` is needed. Unchecked: no released file was at
hand.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_export.bodies.body_model import SMPLX_JOINTS, BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.inputs import DEPTH, ZERO, check_given, given_files
from avatar_export.bodies.subject_files import read_shape
from avatar_export.fit.embedded import own_mesh_fit
from avatar_export.fit.judge import Sides
from avatar_export.fit.places import regressor_notes
from avatar_export.fit.surface import Mesh
from avatar_export.formats.casts import as_float64
from avatar_export.formats.point_cloud import PointCloud, read_ply
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import provenance
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_export.sparse import no_deltas, no_shifts, sparse_rows
from avatar_runtime.avatar import F32, F64, I64, Avatar, Gaussians, Group, RasterSettings, Rig, Rules
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import owned

SYSTEM = "lhm"
COMMIT = "aigc3d/LHM b31e76a"
POINTS = "dense_sample_points"
MODELS = ("SMPLX_NEUTRAL.npz", "SMPLX_NEUTRAL.pkl", "SMPLX_*.npz")
FILES = (
    "NAME.ply, as LHM's mesh export saves it (it is recognised by --system lhm alone)",
    "--body-model: SMPLX_NEUTRAL.npz; --shape: the person's 10 betas",
    f"--dataset: the release's pretrained_models, for {POINTS}/*_COUNT.ply and the body model",
)
USED_OPTIONS = ("body_model", "shape", "dataset", "exact", "name", "accept_misfit")
WITHOUT_RIG = ReadOptions()
WHITE = (1.0, 1.0, 1.0)  # of its pictures
BLOCK = 1024  # points at a time
LEAST = 1e-7  # metres that an expression moves a Gaussian; less is dropped
EXPRESSION_RANGE = (-2.0, 2.0)  # standard deviations
HOW = "pass --dataset PRETRAINED_MODELS of the release"


def detect(path: Path) -> bool:
    """Never: the file is like any other .ply of Gaussians, and --system lhm says what it is."""
    return False


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError without a body model of 55 joints, and for unsound data."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
        if path.suffix.lower() != ".ply" or not path.is_file():
            raise AvatarError("is not a .ply that LHM saved", file=path)
        for name in ("body_model", "shape"):
            check_given(options, name, SYSTEM)
        body_file = options.body_model or _found(options.dataset, MODELS)
        if body_file is None:
            raise AvatarError(f"needs --body-model SMPLX_NEUTRAL.npz, or {HOW}", file=path)
        body = read_body_model(body_file)
        if len(body.joint_names) != SMPLX_JOINTS:
            raise AvatarError(
                f"has {len(body.joint_names)} joints; SMPL-X has {SMPLX_JOINTS}",
                file=body_file,
                field="weights",
            )
        splats = ply.gaussians(read_ply(PointCloud(path, (path.parent,))), path)
        rig = _rig(body, _betas(options))
        points_file = _found(
            options.dataset, (f"{POINTS}/1_{splats.count}.ply", f"{POINTS}/*_{splats.count}.ply")
        )
        row, notes = _vertex_of(splats, body, rig, points_file)
        avatar = check_avatar(_avatar(options, path, splats, body, rig, row))
        sides = Sides("the Gaussians", body_file.name, SYSTEM, body_file, accept=options.accept_misfit)
        notes += own_mesh_fit(avatar, Mesh.of(rig.vertices, rig.triangles), sides)
        notes += regressor_notes(body.joint_regressor, body.triangles, body.joint_names, body_file.name)
        if options.shape is None:
            notes.append(fact("mean_identity", options=("--shape",)))
        files = {path.name: path, f"body_model/{body_file.name}": body_file}
        files |= {} if points_file is None else {f"{POINTS}/{points_file.name}": points_file}
        files |= given_files(options, "shape")
        notes = [fact("unchecked"), *notes]
        return replace(
            avatar, provenance=provenance(SYSTEM, files, notes, commit=COMMIT, body_licence=body.licence)
        )


def _found(folder: Path | None, patterns: tuple[str, ...]) -> Path | None:
    """The first file of the patterns in a folder or up to DEPTH below it. Raises AvatarError if there is no folder."""
    if folder is None:
        return None
    if not folder.is_dir():
        raise AvatarError("no such folder", file=folder, field="--dataset")
    for pattern in patterns:
        for depth in range(DEPTH + 1):
            files = sorted(file for file in folder.glob("*/" * depth + pattern) if file.is_file())
            if files:
                return files[0]
    return None


def _betas(options: ReadOptions) -> F64 | None:
    return None if options.shape is None or str(options.shape) == ZERO else read_shape(options.shape)


def _rig(body: BodyModel, betas: F64 | None) -> Rig:
    """SMPL-X as LHM poses it: without pose correctives, and with joints that expressions do not move."""
    rig = bake_rig(body, betas)
    return replace(
        rig,
        correctives=no_shifts(body.vertex_count),
        corrective_joints=np.zeros(0, np.int32),
        joint_basis=np.zeros_like(rig.joint_basis),
    )


def _vertex_of(
    splats: Gaussians, body: BodyModel, rig: Rig, points_file: Path | None
) -> tuple[I64, list[Note]]:
    """The vertex [N] whose weights each Gaussian takes, and what is doubtful about it."""
    if points_file is None:
        missing = doubt("no_sampled_points", pattern=f"{POINTS}/*_{splats.count}.ply", how=HOW)
        return nearest_vertices(splats.mean, rig.vertices), [missing]
    rows = ply.decode(points_file.read_bytes(), points_file).properties
    if any(axis not in rows for axis in "xyz"):
        raise AvatarError("has no properties x, y, z", file=points_file)
    points = as_float64(np.stack([rows[axis] for axis in "xyz"], axis=1))
    if len(points) != splats.count or not np.isfinite(points).all():
        raise AvatarError(
            f"has {len(points)} points, or one that is not finite; {splats.count} are needed",
            file=points_file,
        )
    return nearest_vertices(points, body.v_template), []


def nearest_vertices(points: F32 | F64, vertices: F32) -> I64:
    """[N] the row of the nearest of `vertices` [V, 3] for each of `points` [N, 3]; the first of equal ones."""
    goal = vertices.astype(np.float64)
    squares = np.sum(goal * goal, axis=1)
    found = np.empty(len(points), np.int64)
    for first in range(0, len(points), BLOCK):
        block = points[first : first + BLOCK].astype(np.float64)
        found[first : first + BLOCK] = np.argmin(squares - 2 * (block @ goal.T), axis=1)
    return found


def _avatar(
    options: ReadOptions, path: Path, splats: Gaussians, body: BodyModel, rig: Rig, row: I64
) -> Avatar:
    n, names = splats.count, body.expression_names
    expressions = tuple(replace(e, range=EXPRESSION_RANGE) for e in expressions_named(names))
    moved = np.moveaxis(body.expression_dirs, 2, 1)[row]  # [N, E, 3]
    least = {"mean": 0.0 if options.exact else LEAST, "quat_wxyz": 0.0}
    still = np.zeros((*moved.shape[:2], 4), np.float32)
    return Avatar(
        name=options.name or path.stem,
        gaussians=splats,
        groups=(Group("body", 0, n, "skin"),),
        rules=Rules(rotation="polar3", sh_direction="inverse_rotation" if splats.sh_degree else "world"),
        expressions=expressions,
        eyelids=(),
        blendshapes=replace(
            no_deltas(n, len(names), coefficients=splats.sh.shape[1]),
            geometry=sparse_rows({"mean": moved, "quat_wxyz": still}, least),
        ),
        skin=rig.skin.take(row),
        rig=rig,
        sh_degree=splats.sh_degree,
        driving=rig_driving(rig, expressions),
        raster=RasterSettings(background=WHITE),
        head_pose_in="mesh",
        delta_threshold={"mean": least["mean"]},
    )
