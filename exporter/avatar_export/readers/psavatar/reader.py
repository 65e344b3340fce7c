"""PSAvatar (arXiv 2401.12900): Gaussians sampled on and off a morphable mesh with learned deformations.

Its repository has no code: the layout is that of avatar-train (schema/PSAVATAR.md). Scale, opacity and colour come
from point_cloud.ply; its x y z and rot_* are those on the mesh at rest, which psavatar.npz gives too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.fit.places import stored_positions
from avatar_export.fit.stored import stored_doubts
from avatar_export.formats.point_cloud import NAME, PointCloud, locate, read_ply, taken_iteration
from avatar_export.notes.note import Note, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import provenance
from avatar_export.readers import surface
from avatar_export.readers.enhancer_file import read_enhancer
from avatar_export.readers.psavatar.files import FILE, KEYS, StoredPoints, find_points, read_points
from avatar_export.readers.rules_file import RULES_FILE, read_rules
from avatar_export.rigs.embedded_rig import RIG_INPUTS, EmbeddedRig, embedded_rig, no_rig
from avatar_runtime.avatar import F32, F64, I32, I64, Avatar, Embedding, Rig, Rules, SparseRows
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.io.ownership import owned
from avatar_runtime.stages.joints import rest_transforms

SYSTEM = "psavatar"
COMMIT = "arXiv 2401.12900 as avatar-train has it"
FILES = (
    f"point_cloud/iteration_N/{NAME} (scale, opacity, colour; the newest N is read)",
    f"{FILE} beside it, of any name (keys {', '.join(KEYS[:3])} ...)",
    f"{RULES_FILE} beside it (optional: how it was trained); enhancer.onnx and enhancer.json (optional)",
    "beside it: --body-model with --shape or --poses, or --rig (.glb, .fbx): rotations are those of its skeleton",
)
WITHOUT_RIG = ReadOptions(no_rig=True)
USED_OPTIONS = (
    *("body_model", "shape", "dataset", "rig", "poses", "no_rig"),
    *("sh_degree", "exact", "name", "accept_misfit"),
)
RULES = Rules(
    position="interpolated_normal", rotation="bary_vertex_lbs", scale="none", sh_direction="inverse_rotation"
)
WITHOUT_SKELETON = "vertex_quaternion"  # the nearest rule that needs only a posed mesh
PLAYED_RULES: dict[str, tuple[str, ...]] = {}  # all are played in the same way
RECORDED_RULES = {
    "acquisition": ("points", "gaussians"),
    "order": ("mesh_first",),
    "displacement": ("off_mesh", "all"),
}
LEAST_SHIFT = 1e-9  # metres; smaller shifts are dropped. Points far off a mesh move a hundred times as far
TURNED = 1e-4  # tolerance between a joint's rest frame and the mesh's


@dataclass(frozen=True)
class Coefficient:
    """The factor of a learned basis vector: the weight of an expression, or an entry of R - I of a joint."""

    expression: str | None
    joint: str = ""
    entry: int = 0  # row-major


def detect(path: Path) -> bool:
    """Whether `path` is a run, an iteration's folder or a .ply with such an .npz beside it; never raises."""
    return locate(path, _complete) is not None


def _complete(cloud: PointCloud) -> bool:
    return find_points(cloud) is not None


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError if no rig is given, and for unsound data."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
        options.refuse_beside_no_rig(RIG_INPUTS, SYSTEM)
        cloud = locate(path, _complete)
        found = None if cloud is None else find_points(cloud)
        if cloud is None or found is None:
            raise AvatarError(f"has no {NAME} with {FILE} beside it", file=path)
        taken = taken_iteration(path, cloud, f"{NAME} and {FILE}")
        splats = ply.gaussians(read_ply(cloud), cloud.file)
        points = read_points(found, splats.count)
        trained = read_rules(cloud.find(RULES_FILE), SYSTEM, PLAYED_RULES, RECORDED_RULES)
        enhancer = read_enhancer(cloud.file.parent)
        rig, rules, notes = _taught_rig(points, options)
        avatar = surface.surface_avatar(
            name=options.name or cloud.name,
            gaussians=splats,
            embedding=_embedding(points),
            rules=rules,
            rig=rig,
            sh_degree=surface.degree_of(options.sh_degree, splats, cloud.file, "--sh-degree"),
            background="random",
            units=points.training_per_metre,
        )
        fits = surface.fit_notes(avatar, options, found, SYSTEM)
        fits += stored_positions(avatar, splats.mean, cloud.file, options.accept_misfit, SYSTEM)
        fits += stored_doubts(splats.mean, splats.quat_wxyz, avatar, NAME)
        files = {NAME: cloud.file, found.name: found, **rig.files}
        files |= {} if trained.file is None else {RULES_FILE: trained.file}
        if enhancer is not None:
            files |= {name: cloud.file.parent / name for name in ("enhancer.onnx", "enhancer.json")}
        notes = [*trained.notes(), *points.notes, *notes, *fits, *rig.notes, *taken]
        return replace(avatar, enhancer=enhancer, provenance=provenance(SYSTEM, files, notes, commit=COMMIT))


def _embedding(points: StoredPoints) -> Embedding:
    return Embedding(
        canonical_vertices=points.mesh.vertices,
        triangles=points.mesh.triangles,
        triangle=points.triangle,
        barycentric=points.barycentric,
        displacement=points.displacement,
        local_offset=np.zeros((0, 3), np.float32),
        local_quat_wxyz=points.local_quat_wxyz,
    )


def _taught_rig(points: StoredPoints, options: ReadOptions) -> tuple[EmbeddedRig, Rules, list[Note]]:
    """(rig with the learned bases in its morphs and correctives, rules, notes)."""
    if options.no_rig:
        note = fact("without_skeleton", rule=WITHOUT_SKELETON)
        return no_rig(), replace(RULES, rotation=WITHOUT_SKELETON), [note]
    given = embedded_rig(points.mesh.vertices, points.mesh.triangles, options, SYSTEM)
    if given.rig is None:
        raise AvatarError(
            "needs the skeleton of its training: pass --body-model with --shape or --poses, or --rig "
            "FILE.glb|.fbx, or --no-rig for an approximation on posed meshes",
            file=points.file,
        )
    names = [expression.name for expression in given.expressions]
    rig = taught(given.rig, names, points, 0.0 if options.exact else LEAST_SHIFT)
    return replace(given, rig=rig), RULES, [fact("bases_in_rig", count=len(points.basis_names))]


def taught(rig: Rig, expressions: Sequence[str], points: StoredPoints, least: float) -> Rig:
    """`rig` with the learned bases added: E' to its morphs, P' to its correctives (Eqs. 5, 6).

    The bases of the body model alone move the joints: `joint_basis` is not changed. Shifts of at most `least` metres
    on each axis are left out. Raises AvatarError for a name that the rig lacks, and for a joint whose rest frame is
    rotated against the mesh, since its R - I then differs from that of training.
    """
    wanted = [_coefficient(name, points) for name in points.basis_names]
    column = {name: k for k, name in enumerate(expressions)}
    joints = _corrective_joints(rig, wanted, points)
    feature = {rig.joint_names[joint]: 9 * c for c, joint in enumerate(joints)}
    morph_rows, morph_columns, pose_rows, pose_columns = [], [], [], []
    for row, coefficient in enumerate(wanted):
        if coefficient.expression is None:
            pose_rows.append(row)
            pose_columns.append(feature[coefficient.joint] + coefficient.entry)
        elif coefficient.expression in column:
            morph_rows.append(row)
            morph_columns.append(column[coefficient.expression])
        else:
            raise no_such(
                "expression of the rig", coefficient.expression, expressions, file=points.file,
                field=f"basis_names[{row}]",
            )  # fmt: skip
    correctives = replace(rig.correctives, columns=9 * len(joints))
    return replace(
        rig,
        morphs=_added(rig.morphs, points.basis[morph_rows], morph_columns, least),
        correctives=_added(correctives, points.basis[pose_rows], pose_columns, least),
        corrective_joints=joints,
    )


def _coefficient(name: str, points: StoredPoints) -> Coefficient:
    """The coefficient called `name`: "expression/NAME" or "pose/JOINT/ROW/COLUMN"."""
    kind, _, rest = name.partition("/")
    if kind == "expression" and rest:
        return Coefficient(rest)
    joint, _, entry = rest.rpartition("/")
    joint, _, row = joint.rpartition("/")
    if kind == "pose" and joint and row in ("0", "1", "2") and entry in ("0", "1", "2"):
        return Coefficient(None, joint, 3 * int(row) + int(entry))
    raise AvatarError(
        f"{name[:80]!a} is neither expression/NAME nor pose/JOINT/ROW/COLUMN",
        file=points.file,
        field="basis_names",
    )


def _corrective_joints(rig: Rig, wanted: Sequence[Coefficient], points: StoredPoints) -> I32:
    """The corrective joints of the rig, then those that only the learned bases name."""
    joints = [int(joint) for joint in rig.corrective_joints]
    rest = rest_transforms(rig)
    for name in dict.fromkeys(c.joint for c in wanted if c.expression is None):
        if name not in rig.joint_names:
            raise no_such("joint of the rig", name, rig.joint_names, file=points.file, field="basis_names")
        joint = rig.joint_names.index(name)
        if np.abs(rest[joint, :3, :3] - np.eye(3)).max() > TURNED:
            raise AvatarError(
                f"joint {name!a} of the rig has a rotated rest frame, but the learned bases need its rotation in the "
                "frame of the mesh; pass --body-model instead",
                file=points.file,
                field="basis_names",
            )
        if joint not in joints:
            joints.append(joint)
    return np.array(joints, np.int32)


def _added(sparse: SparseRows, basis: F32, columns: Sequence[int], least: float) -> SparseRows:
    """`sparse` [V, C] of `position` plus `basis` [U, V, 3] in its `columns` [U], without a dense copy."""
    width = sparse.columns
    stored: I64 = sparse.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(sparse.rows), stored[1:] - stored[:-1])
    moves = (np.abs(basis) > least).any(axis=2)
    which, vertex = np.nonzero(moves)
    keys = np.concatenate([row * width + sparse.column, vertex * width + np.array(columns, np.int64)[which]])
    values = np.concatenate([sparse.values["position"], basis[which, vertex]]).astype(np.float64)
    unique, place = np.unique(keys, return_inverse=True)
    total: F64 = np.zeros((len(unique), 3))
    np.add.at(total, place, values)
    ptr = np.searchsorted(unique, np.arange(sparse.rows + 1) * width)
    return SparseRows(
        ptr.astype(np.uint32),
        (unique % max(width, 1)).astype(np.uint16),
        {"position": total.astype(np.float32)},
        width,
    )
