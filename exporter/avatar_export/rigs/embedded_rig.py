"""The rig of the mesh under embedded Gaussians: from a rig file, from a body model with tracked poses, or none.

Systems that embed Gaussians in a mesh store the mesh of one posed frame, without a rig. A rig from another file must
have the vertices of that mesh; they are renumbered in the mesh's order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from avatar_export.bodies.body_model import BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig, with_static_offset
from avatar_export.bodies.inputs import ZERO, check_given, find_inputs, given_files
from avatar_export.bodies.pose_files import BodyPoses, body_clip, read_poses
from avatar_export.bodies.subject_files import read_shape
from avatar_export.clips.poses import clip_poses, first_frame, rig_avatar
from avatar_export.clips.sources import clips_from
from avatar_export.fit.embedded import Posed, rig_fit
from avatar_export.fit.judge import Sides
from avatar_export.fit.places import regressor_notes
from avatar_export.fit.skeleton import inhuman, skeleton_doubts
from avatar_export.fit.surface import Mesh
from avatar_export.notes.note import Note, doubt, fact
from avatar_export.options import ReadOptions
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_export.rigs.rig_file import read_rig_file
from avatar_export.rigs.vertex_map import vertex_map
from avatar_runtime.avatar import F32, F64, I64, U32, Avatar, Clip, Driving, Expression, Rig
from avatar_runtime.engine_pose import rests_bound
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose

RIG_INPUTS = ("rig", "body_model", "shape", "poses")  # that `embedded_rig` uses, besides `dataset`
POSE_FILES = ("flame_params.json", "poses.npz", "flame_param.npz")
SAME_SHAPE = 1e-3  # of an identity coefficient, in standard deviations


@dataclass(frozen=True)
class EmbeddedRig:
    """A rig with the vertices and triangles of a given mesh, with its expressions, clips and driving."""

    rig: Rig | None
    expressions: tuple[Expression, ...] = ()
    clips: tuple[Clip, ...] = ()
    driving: Driving = field(default_factory=Driving)
    notes: tuple[Note, ...] = ()
    files: Mapping[str, Path] = field(default_factory=dict)  # "ROLE/FILE" -> path, for the provenance
    head_pose_in: str = "mesh"
    fits: bool = False  # whether one of its poses is the given mesh, so that its unit is right


def no_rig() -> EmbeddedRig:
    """An EmbeddedRig without a rig: the avatar plays on posed vertices only."""
    return EmbeddedRig(None, notes=(fact("no_rig_given"),))


def embedded_rig(
    vertices: F32, triangles: U32, options: ReadOptions, owner: str, units: float | None = None
) -> EmbeddedRig:
    """The rig that `options` give for the mesh `vertices` [V, 3] in metres, `triangles` [F, 3].

    `rig`: a .glb or .fbx of the mesh; its morph targets are the expressions, its animations the clips.
    `body_model`: FLAME or SMPL with the identity of `shape`, else of `poses`; `poses` become a clip. Body model,
    shape and poses may be found in `dataset`. Without these options there is no rig. `units`: the value of --units by
    which the mesh came to metres. Raises AvatarError for both, for damaged files, for a rig of another mesh, and,
    unless `accept_misfit`, for one that lies far from the mesh.
    """
    if options.rig is not None and options.body_model is not None:
        raise AvatarError("--rig and --body-model both give a rig; pass only one of them", owner=owner)
    if options.rig is not None:
        if options.shape is not None:
            raise AvatarError("--shape needs --body-model; a --rig has its own shape", owner=owner)
        _check_given(options, owner)
        return _from_file(_Given(vertices, triangles, options.rig, options, owner, units))
    asked = options
    if options.dataset is not None:
        options = _searched(options, options.dataset, owner)
    if options.body_model is not None:
        _check_given(options, owner)
        return _from_body_model(_Given(vertices, triangles, options.body_model, options, owner, units))
    if given := [name for name in ("shape", "poses") if getattr(asked, name) is not None]:
        raise AvatarError(f"--{given[0]} needs a rig: pass --body-model or --rig too", owner=owner)
    return no_rig()


def _searched(options: ReadOptions, dataset: Path, owner: str) -> ReadOptions:
    """`options`, completed with the files in a dataset folder."""
    inputs = find_inputs(dataset, options, owner)
    poses = (sorted(dataset.glob(pattern)) for name in POSE_FILES for pattern in (name, f"*/{name}"))
    first = next((found[0] for found in poses if found), None)
    body = options.body_model or inputs.body_model
    return replace(
        options, body_model=body, shape=options.shape or inputs.shape, poses=options.poses or first
    )


def _check_given(options: ReadOptions, owner: str) -> None:
    for name in RIG_INPUTS:
        check_given(options, name, owner)


@dataclass(frozen=True)
class _Given:
    """The mesh of an embedding, and the file that gives its rig."""

    vertices: F32  # [V, 3]
    triangles: U32  # [F, 3]
    path: Path
    options: ReadOptions
    owner: str
    units: float | None

    def mapped(self, rig: Rig, vertex_ids: I64 | None) -> tuple[Rig, list[Note]]:
        """`rig` in the numbering of the mesh, and how its vertices were found. Raises AvatarError for another mesh."""
        try:
            found = vertex_map(rig, vertex_ids, self.triangles, self.vertices)
        except AvatarError as error:
            raise AvatarError(error.message, file=self.path, owner=self.owner) from None
        notes = [fact("vertices_found", file=self.path.name, how=found.how)]
        if found.disagreeing:
            notes.append(fact("vertices_repeated", count=found.disagreeing, file=self.path.name))
        return renumbered(rig, found.rows, self.triangles), notes

    def fit(self, avatar: Avatar) -> tuple[list[Note], bool]:
        """(notes, whether they fit) on the distance between rig and mesh, at rest and in the first frame of a clip."""
        poses = {"at rest": Pose()}
        for clip in avatar.clips[:1]:
            poses[f"in frame 0 of {clip.name!r}"] = clip_poses(avatar, first_frame(clip))[0]
        player, used = Player(avatar, "reference"), np.unique(self.triangles)
        tracked = self.options.poses is not None
        posed = [
            Posed(when, player.mesh(pose)[used].astype(np.float64), tracked and pose is not poses["at rest"])
            for when, pose in poses.items()
        ]
        own_unit = self.units is not None and inhuman(posed[0].vertices, None) is None
        sides = Sides(
            "the mesh", self.path.name, self.owner, self.path, "--units", self.units or 1.0, own_unit,
            self.options.accept_misfit,
        )  # fmt: skip
        return rig_fit(self.vertices[used].astype(np.float64), posed, sides)


def _from_file(given: _Given) -> EmbeddedRig:
    path, poses = given.path, given.options.poses
    found = read_rig_file(path)
    rig, notes = given.mapped(found.rig, found.vertex_ids)
    expressions = expressions_named(found.morph_names)
    avatar = rig_avatar(rig, expressions)
    clips = clips_from(avatar, path, optional=True)
    files = {f"rig/{path.name}": path}
    if poses is not None:
        clips = (*clips_from(replace(avatar, clips=clips), poses), *clips)
        files[f"poses/{poses.name}"] = poses
    near, fits = given.fit(replace(avatar, clips=clips))
    driving = rig_driving(rig, expressions)
    return EmbeddedRig(rig, expressions, clips, driving, (*found.notes, *notes, *near), files, fits=fits)


def _from_body_model(given: _Given) -> EmbeddedRig:
    path, options = given.path, given.options
    body = read_body_model(path)
    poses = None if options.poses is None else read_poses(options.poses)
    shape, notes = _identity(options, poses)
    if poses is not None and poses.static_offset is not None:
        body = _with_offset(body, poses.static_offset, options.poses)
    elif options.shape is not None:
        body = with_static_offset(body, options.shape)
    rig, found = given.mapped(bake_rig(body, shape), None)
    expressions = expressions_named(body.expression_names)
    clips: tuple[Clip, ...] = ()
    files = {f"body_model/{path.name}": path, **given_files(options, "shape", "poses")}
    if poses is not None and options.poses is not None:
        clips = (body_clip(rig, poses, options.poses.stem),)
        notes += poses.notes(options.poses)
    near, fits = given.fit(replace(rig_avatar(rig, expressions), clips=clips))
    notes += regressor_notes(body.joint_regressor, body.triangles, body.joint_names, path.name)
    notes += [*found, *near, *skeleton_doubts(rig, Mesh.of(rig.vertices, rig.triangles), path.name)]
    driving = rig_driving(rig, expressions)
    return EmbeddedRig(rig, expressions, clips, driving, tuple(notes), files, fits=fits)


def _identity(options: ReadOptions, poses: BodyPoses | None) -> tuple[F64 | None, list[Note]]:
    if options.shape is not None:
        given = None if str(options.shape) == ZERO else read_shape(options.shape)
        return given, _other_shape(given, poses, options)
    if poses is not None and len(poses.shape):
        return poses.shape, []
    return None, [fact("mean_identity", options=("--shape", "--poses"))]


def _other_shape(given: F64 | None, poses: BodyPoses | None, options: ReadOptions) -> list[Note]:
    """A doubt, if the tracked poses have another identity than the one given."""
    if poses is None or not len(poses.shape) or options.poses is None:
        return []
    own = np.zeros(0) if given is None else given
    count = max(len(own), len(poses.shape))
    one, other = (np.pad(shape, (0, count - len(shape))) for shape in (own, poses.shape))
    if np.allclose(one, other, atol=SAME_SHAPE):
        return []
    named = ZERO if given is None else Path(str(options.shape)).name
    return [doubt("identity_differs", file=options.poses.name, given=named)]


def rest_vertices(rig: Rig) -> F32:
    """[V, 3] the mesh at rest: the template, unless the rig does not rest in its binding pose."""
    return rig.vertices if rests_bound(rig) else Player(rig_avatar(rig, ()), "reference").mesh(Pose())


def _with_offset(body: BodyModel, offset: F32, path: Path | None) -> BodyModel:
    if len(offset) != body.vertex_count:
        raise AvatarError(
            f"has {len(offset)} vertices, but the body model has {body.vertex_count}; GaussianAvatars adds 120 "
            "vertices of teeth to FLAME: pass a body model or a --rig with them",
            file=path,
            field="static_offset",
        )
    return replace(body, v_template=body.v_template + offset)


def renumbered(rig: Rig, rows: I64, triangles: U32) -> Rig:
    """`rig` with only its vertices `rows` [V], in that order, and with other `triangles` [F, 3]."""
    return replace(
        rig,
        vertices=rig.vertices[rows],
        triangles=triangles,
        morphs=rig.morphs.take(rows),
        correctives=rig.correctives.take(rows),
        late_morphs=rig.late_morphs.take(rows),
        skin=rig.skin.take(rows),
        anchor_vertices=np.zeros(0, np.uint32),
    )
