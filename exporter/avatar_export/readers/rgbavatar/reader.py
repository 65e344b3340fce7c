"""RGBAvatar (LinzhouLi/RGBAvatar 27c2ba8): Gaussians in tangent frames of FLAME's triangles, with 20 linear bases.

A network turns 129 values of FLAME into the weights of the bases. Bundles have no tangent frames: the Gaussians become
skinned ones, and what triangles and bases do becomes deltas of the expressions, exact at rest; the reader measures how
far off other poses are. Unchecked: no released file was at hand; tests compare with a transcription.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.bodies.body_model import JOINT_NAMES, BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.inputs import ZERO, find_inputs, given_files
from avatar_export.bodies.pose_files import body_clip, read_poses
from avatar_export.bodies.subject_files import read_shape
from avatar_export.fit.embedded import own_mesh_fit
from avatar_export.fit.judge import Sides
from avatar_export.fit.places import regressor_notes
from avatar_export.fit.surface import Mesh
from avatar_export.formats.obj import TriangleMesh
from avatar_export.formats.point_cloud import PointCloud
from avatar_export.notes.note import Note, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import provenance
from avatar_export.readers import surface
from avatar_export.readers.rgbavatar import drivers, files, frames, measured
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_runtime.avatar import F64, Avatar, Clip, Expression, Group, RasterSettings, Rig, Rules
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import of_file, owned

SYSTEM = "rgbavatar"
COMMIT = "LinzhouLi/RGBAvatar 27c2ba8"
FILES = (
    f"{files.NAME} (Gaussians, bases {', '.join(files.MARKS)} ..., the network, triangles), or its run folder",
    f"{files.CONFIG} beside it (optional: the kind of the network)",
    f"--body-model: .npz of FLAME with the release's teeth, {files.UVS} and {files.UV_FACES}",
    "--shape, --poses (optional: identity, tracked poses)",
)
USED_OPTIONS = ("body_model", "shape", "dataset", "poses", "exact", "name", "accept_misfit")
WITHOUT_RIG = ReadOptions()
RULES = Rules(rotation="polar3", sh_direction="world")
THRESHOLDS = {"mean": 1e-6, "quat_wxyz": 1e-5, "log_scale": 0.0, "opacity_logit": 0.0, "sh": 1e-5}
STANDARD_RANGE = (-2.0, 2.0)  # of coefficients of FLAME, in standard deviations
BASIS_RANGE = (-1.0, 1.0)  # of a basis whose weight no clip shows
BASIS = "basis_{:02d}"
EYELIDS = ("eyelid_left", "eyelid_right")
TOPOLOGY = "its mesh is FLAME with 60 vertices and 56 triangles of teeth that the release adds"


@dataclass(frozen=True)
class _Subject:
    """The body model with the subject's identity, and everything that moves the Gaussians on it."""

    binding: frames.Binding
    rig: Rig
    expressions: tuple[Expression, ...]  # FLAME's, eyelids, then the bases where the network is deep
    map: drivers.Map

    @property
    def network(self) -> files.Network:
        return self.binding.model.network


def detect(path: Path) -> bool:
    """Whether `path` is a run folder with such a model.ply, or the .ply; never raises."""
    try:
        return files.located(path) is not None
    except OSError:
        return False


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError if no body model is given, and for unsound data."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
        cloud = files.located(path)
        if cloud is None:
            raise AvatarError(f"has no {files.NAME} with {' and '.join(files.MARKS)}", file=path)
        found = find_inputs(cloud.file.parent, options, SYSTEM)
        options = replace(options, body_model=found.body_model, shape=options.shape or found.shape)
        if options.body_model is None:
            raise AvatarError(f"needs --body-model BODY.npz: {TOPOLOGY}; {files.PAGE} shows how to write it")
        return _read(cloud, options, options.body_model)


def _read(cloud: PointCloud, options: ReadOptions, body_file: Path) -> Avatar:
    body = read_body_model(body_file)
    subject = _subject(files.read_model(cloud), body, body_file, options)
    clips, clip_notes = _clips(subject, options)
    avatar = _avatar(subject, options.name or cloud.name, clips, 0.0 if options.exact else 1.0)
    sides = Sides("the Gaussians", body_file.name, SYSTEM, body_file, accept=options.accept_misfit)
    check_avatar(avatar)
    assert avatar.rig is not None
    with of_file(body_file):
        errors = measured.note(avatar, subject.binding, subject.map)
    notes = [
        fact("unchecked"),
        _network_note(subject),
        *clip_notes,
        errors,
        *own_mesh_fit(avatar, Mesh.of(avatar.rig.vertices, avatar.rig.triangles), sides),
        *regressor_notes(body.joint_regressor, body.triangles, body.joint_names, body_file.name),
    ]
    if options.shape is None and options.poses is None:
        notes.append(fact("mean_identity", options=("--shape", "--poses")))
    own = _files(cloud, options, body_file)
    return replace(
        avatar, provenance=provenance(SYSTEM, own, notes, commit=COMMIT, body_licence=body.licence)
    )


def _files(cloud: PointCloud, options: ReadOptions, body_file: Path) -> Mapping[str, Path]:
    given = {files.NAME: cloud.file, f"body_model/{body_file.name}": body_file}
    config = files.config_file(cloud)
    given |= {} if config is None else {files.CONFIG: config}
    return {**given, **given_files(options, "shape", "poses")}


def _subject(model: files.Model, body: BodyModel, file: Path, options: ReadOptions) -> _Subject:
    if body.joint_names != JOINT_NAMES[5]:
        raise AvatarError(f"has {len(body.joint_names)} joints; FLAME has 5", file=file, field="weights")
    body, names = _with_eyelids(body, file)
    if not model.network.linear:
        bases = tuple(BASIS.format(k) for k in range(model.mean_basis.shape[1]))
        still = np.zeros((body.vertex_count, 3, len(bases)), np.float32)
        body = replace(body, expression_dirs=np.concatenate([body.expression_dirs, still], axis=2))
        names = (*names, *bases)
    rig = bake_rig(body, _identity(options))
    mesh = TriangleMesh(rig.vertices, rig.triangles)
    triangle = surface.triangle_rows(model.triangle, mesh, file, files.FACE, f"; {TOPOLOGY}")
    surface.check_barycentric(model.barycentric, file, "face_bary")
    surface.check_areas(mesh, triangle, file)
    uv_corners = files.read_uv_corners(file, len(rig.triangles))
    own = body.expression_dirs.shape[2] - (0 if model.network.linear else model.mean_basis.shape[1])
    lids = len(EYELIDS) if EYELIDS[0] in names else 0
    return _Subject(
        frames.Binding(model, rig.triangles, uv_corners, triangle),
        rig,
        tuple(
            replace(e, range=e.range if canonical(e.name) or e.name in EYELIDS else STANDARD_RANGE)
            for e in expressions_named(names)
        ),
        drivers.Map(model.network, own - lids, lids, len(names)),
    )


def _with_eyelids(body: BodyModel, file: Path) -> tuple[BodyModel, tuple[str, ...]]:
    """The release adds eyelids before skinning: they are expressions here."""
    shapes = files.read_eyelid_shapes(file, body.vertex_count)
    if not shapes:
        return body, body.expression_names
    both = np.concatenate([body.expression_dirs, np.stack(shapes, axis=2)], axis=2)
    return replace(body, expression_dirs=both), (*body.expression_names, *EYELIDS)


def _identity(options: ReadOptions) -> F64 | None:
    if options.shape is not None:
        return None if str(options.shape) == ZERO else read_shape(options.shape)
    if options.poses is not None:
        shape = read_poses(options.poses).shape
        return shape if len(shape) else None
    return None


def _avatar(subject: _Subject, name: str, clips: tuple[Clip, ...], dropping: float) -> Avatar:
    rest = subject.map.at_rest()
    thresholds = {part: dropping * least for part, least in THRESHOLDS.items()}
    expressions = _ranged(subject.expressions, clips)
    return Avatar(
        name=name,
        gaussians=frames.at_rest(subject.binding, subject.rig.vertices.astype(np.float64), rest),
        groups=(Group("head", 0, len(subject.binding.triangle), "skin"),),
        rules=RULES,
        expressions=expressions,
        eyelids=(),
        blendshapes=frames.blendshapes(
            subject.binding,
            subject.rig,
            rest,
            subject.map.of_expressions(),
            subject.map.of_pose_features(),
            thresholds,
        ),
        skin=frames.skin(subject.binding, subject.rig),
        rig=subject.rig,
        sh_degree=0,
        driving=rig_driving(subject.rig, expressions),
        raster=RasterSettings(background="random"),
        head_pose_in="mesh",
        delta_threshold=thresholds,
        clips=clips,
    )


def _ranged(expressions: tuple[Expression, ...], clips: tuple[Clip, ...]) -> tuple[Expression, ...]:
    """Bases have the range that the clips show."""
    bases = {e.name for e in expressions if e.name.startswith(BASIS[:6])}
    result = []
    for column, e in enumerate(expressions):
        low, high = BASIS_RANGE
        if clips:
            seen = np.concatenate([clip.expression_weights[:, column] for clip in clips])
            low, high = min(0.0, float(seen.min())), max(0.0, float(seen.max()))
        result.append(replace(e, range=(low, high)) if e.name in bases else e)
    return tuple(result)


def _clips(subject: _Subject, options: ReadOptions) -> tuple[tuple[Clip, ...], list[Note]]:
    """The tracked poses, with eyelids and with the weights that a deep network gives the bases."""
    if options.poses is None:
        return (), []
    poses = read_poses(options.poses)
    clip = body_clip(subject.rig, poses, options.poses.stem)
    weights = clip.expression_weights.copy()
    lids = files.read_eyelid_weights(options.poses, clip.frames)
    first = subject.map.expressions
    weights[:, first : first + subject.map.eyelids] = lids[:, : subject.map.eyelids]
    if not subject.network.linear:
        turns = clip.joint_delta[:, :, :3, :3].astype(np.float64)
        values = subject.map.values(weights[:, :first], turns, lids, poses.translation)
        weights[:, -len(subject.map.at_rest()) :] = subject.network.weights(values) - subject.map.at_rest()
    return (replace(clip, expression_weights=weights),), poses.notes(options.poses)


def _network_note(subject: _Subject) -> Note:
    if subject.network.linear:
        return fact("linear_network")
    return fact("hidden_layers", count=len(subject.map.at_rest()), first=BASIS.format(0))
