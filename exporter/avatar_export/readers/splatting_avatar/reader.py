"""SplattingAvatar (initialneil/SplattingAvatar 3847314): Gaussians embedded in a triangle mesh.

Scale, opacity and colour come from point_cloud.ply; its x y z and rot_* are those of the first training frame
and follow from the embedding. The mesh is that of this frame, as text with six decimals in embedding.obj.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.fit.places import stored_positions
from avatar_export.fit.stored import stored_doubts
from avatar_export.formats.mesh_files import read_mesh
from avatar_export.formats.point_cloud import NAME, PointCloud, locate, read_ply, taken_iteration
from avatar_export.notes.note import Note, Setting, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import provenance
from avatar_export.readers import surface
from avatar_export.readers.rules_file import RULES_FILE, TrainedRules, read_rules
from avatar_export.readers.splatting_avatar.files import (
    CONFIG,
    FORMS,
    Config,
    StoredEmbedding,
    find_embedding,
    read_config,
    read_embedding,
)
from avatar_export.rigs.embedded_rig import RIG_INPUTS, embedded_rig, no_rig
from avatar_runtime.avatar import Avatar, Embedding, Gaussians, Rules
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import owned
from avatar_runtime.rules import AREA_SCALES, NORMAL_POSITIONS, SH_DIRECTIONS, VERTEX_ROTATIONS

SYSTEM = "splatting_avatar"
COMMIT = "initialneil/SplattingAvatar 3847314"
FILES = (
    f"point_cloud/iteration_N/{NAME} (scale, opacity, colour; the newest N is read)",
    f"{' or '.join(FORMS)} beside it (triangle, weights, displacement, rotation of each Gaussian)",
    "embedding.obj (the mesh they lie on), or --mesh",
    f"{CONFIG} in the run's folder (optional: mesh scaling, view direction, SH degree)",
    f"{RULES_FILE} beside it (optional: rules of the paper in place of the released code's)",
    "beside it: --rig (.glb, .fbx, ASM face .npz), or --body-model with --poses (flame_params.json, poses.npz)",
)
WITHOUT_RIG = ReadOptions(no_rig=True)
USED_OPTIONS = (
    *("body_model", "shape", "dataset", "rig", "poses", "no_rig"),
    *("mesh", "units", "mesh_scaling", "sh_direction", "sh_degree", "quaternion_sign"),
    *("exact", "name", "accept_misfit"),  # exact: there are no deltas to drop
)


@dataclass(frozen=True)
class Preset:
    """The settings of the release for one kind of dataset."""

    units: float  # training units per metre
    mesh_scaling: bool


# dataset.frameset_type of config.yaml. Heads: FLAME times 4 (flame.py:75), configs/splatting_avatar.yaml; bodies: SMPL
# in metres, configs/instant_avatar.yaml.
PRESETS = {"imavatar": Preset(4.0, True), "instant_avatar": Preset(1.0, False)}
OTHERWISE = Preset(1.0, False)  # the code's default of with_mesh_scaling
SCALES: dict[object, str] = {True: "log_area", False: "none"}  # of model.with_mesh_scaling
SCALING = {"log_area": "on", "none": "off"}  # as the note says it; other rules by their name
DIRECTIONS: dict[object, str] = {True: "inverse_rotation", False: "world"}  # of pipe.convert_SHs_python
PLAYED_RULES = {  # of rules.json
    "scale": AREA_SCALES,
    "position": NORMAL_POSITIONS,
    "rotation": VERTEX_ROTATIONS,
    "sh_direction": SH_DIRECTIONS,
}
RECORDED_RULES = {"embedding": ("walking", "clamped", "fixed", "released")}


@dataclass(frozen=True)
class Settings:
    """Settings of the training, from rules.json, config.yaml or options, and the source of each."""

    units: float
    rules: Rules
    sh_degree: int
    notes: tuple[Setting, ...]  # the units first


def detect(path: Path) -> bool:
    """Whether `path` is a run, an iteration's folder or a .ply with an embedding beside it; never raises."""
    return locate(path, _complete) is not None


def _complete(cloud: PointCloud) -> bool:
    return find_embedding(cloud) is not None


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError for missing files and unsound data."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
        options.refuse_beside_no_rig(RIG_INPUTS, SYSTEM)
        cloud = locate(path, _complete)
        found = None if cloud is None else find_embedding(cloud)
        if cloud is None or found is None:
            raise AvatarError(f"has no {NAME} with {' or '.join(FORMS)} beside it", file=path)
        taken = taken_iteration(path, cloud, f"{NAME} and {' or '.join(FORMS)}")
        splats = ply.gaussians(read_ply(cloud), cloud.file)
        stored = read_embedding(found, splats.count)
        config = read_config(cloud)
        trained = read_rules(cloud.find(RULES_FILE), SYSTEM, PLAYED_RULES, RECORDED_RULES)
        settings = _settings(config, trained, options, splats, cloud)
        embedding, mesh_file, notes = _embedding(stored, splats, options, settings.units)
        rig = no_rig() if options.no_rig else embedded_rig(
            embedding.canonical_vertices, embedding.triangles, options, SYSTEM, settings.units
        )  # fmt: skip
        avatar = surface.surface_avatar(
            name=options.name or cloud.name,
            gaussians=replace(splats, log_scale=surface.log_in_metres(splats.log_scale, settings.units)),
            embedding=embedding,
            rules=settings.rules,
            rig=rig,
            sh_degree=settings.sh_degree,
            background="random",  # as trained (gauss_base.py render_to_camera)
            units=settings.units,
        )
        units, *others = settings.notes
        if rig.fits and units.source is None:  # the unit is shown to be right
            units = replace(units, source="assumed; the rig fits so")
        notes = [fact("settings", settings=(units, *others)), *trained.notes(), *notes]
        notes += surface.fit_notes(avatar, options, mesh_file, SYSTEM)
        places = surface.in_metres(splats.mean, settings.units)
        notes += stored_positions(avatar, places, cloud.file, options.accept_misfit, SYSTEM)
        notes += [*stored_doubts(places, splats.quat_wxyz, avatar, NAME), *rig.notes, *taken]
        files = {NAME: cloud.file, found.name: found, mesh_file.name: mesh_file, **rig.files}
        files |= {} if config.file is None else {CONFIG: config.file}
        files |= {} if trained.file is None else {RULES_FILE: trained.file}
        return replace(avatar, provenance=provenance(SYSTEM, files, notes, commit=COMMIT, form=found.name))


def _settings(
    config: Config, trained: TrainedRules, options: ReadOptions, splats: Gaussians, cloud: PointCloud
) -> Settings:
    """Each setting from its option, else rules.json, else config.yaml, else the release's for such a dataset."""
    if config.get("model", "xyz_as_uvd", bool) is False:
        raise AvatarError(
            "is false: these Gaussians are not embedded in the mesh",
            file=config.file,
            field="model.xyz_as_uvd",
        )
    kind = config.get("dataset", "frameset_type", str)
    preset = PRESETS.get(kind, OTHERWISE)
    assumed = f"assumed, usual for {kind}" if kind in PRESETS else None
    stated = _Stated(config, trained)
    scale = stated.setting(
        Setting("scale", preset.mesh_scaling, assumed),
        ("--mesh-scaling", options.mesh_scaling),
        "model.with_mesh_scaling",
    )
    direction = stated.setting(
        Setting("sh_direction", False, "assumed, the code's default"),
        ("--sh-direction", options.sh_direction),
        "pipe.convert_SHs_python",
    )
    degree = stated.setting(
        Setting("sh_degree", splats.sh_degree, NAME), ("--sh-degree", options.sh_degree), "model.sh_degree"
    )
    scale = replace(scale, value=SCALES.get(scale.value, scale.value))
    direction = replace(direction, value=DIRECTIONS.get(direction.value, direction.value))
    carried = {name: trained.played[name] for name in ("position", "rotation") if name in trained.played}
    units = _units(options, trained, Setting("units", preset.units, assumed))
    rules = Rules(
        **{"position": "normal", "rotation": "vertex_quaternion", **carried},
        scale=str(scale.value),
        sh_direction=str(direction.value),
        quaternion_sign=options.quaternion_sign or "w_positive",
    )
    shown = SCALING.get(rules.scale, rules.scale.removesuffix("_area"))
    others = (Setting(name, value, RULES_FILE) for name, value in carried.items())
    return Settings(
        surface.units_of(float(units.value)),
        rules,
        surface.degree_of(int(degree.value), splats, cloud.file, str(degree.source)),
        (units, replace(scale, value=shown), direction, degree, *others),
    )


def _units(options: ReadOptions, trained: TrainedRules, usual: Setting) -> Setting:
    if options.units is not None:
        return replace(usual, value=options.units, source="--units")
    return usual if trained.units is None else replace(usual, value=trained.units, source=RULES_FILE)


@dataclass(frozen=True)
class _Stated:
    """What files say of the training."""

    config: Config
    trained: TrainedRules

    def setting(self, usual: Setting, option: tuple[str, float | str | None], field: str) -> Setting:
        """The setting from its option, else rules.json, else the `field` of config.yaml, else the usual one."""
        flag, given = option
        if given is not None:
            return replace(usual, value=given, source=flag)
        if usual.name in self.trained.played:
            return replace(usual, value=self.trained.played[usual.name], source=RULES_FILE)
        section, key = field.split(".")
        value = self.config.get(section, key, type(usual.value))
        return usual if value is None else replace(usual, value=value, source=f"{CONFIG} {field}")


def _embedding(
    stored: StoredEmbedding, splats: Gaussians, options: ReadOptions, units: float
) -> tuple[Embedding, Path, list[Note]]:
    """(embedding in metres, file of its mesh, notes)."""
    mesh_file = options.mesh or stored.mesh
    if options.mesh is None and not os.path.isfile(mesh_file):
        raise AvatarError(
            f"names {stored.mesh_as_named[:80]!a}, but there is no {stored.mesh.name!a} beside it; pass --mesh",
            file=stored.file,
        )
    mesh = read_mesh(mesh_file)
    triangle = surface.triangle_rows(stored.triangle, mesh, stored.file, "sample_fidxs")
    notes = surface.check_barycentric(stored.barycentric, stored.file, stored.weights_key)
    surface.check_areas(mesh, triangle, mesh_file)
    vertices = surface.in_metres(mesh.vertices, units)
    embedding = Embedding(
        canonical_vertices=vertices,
        triangles=mesh.triangles,
        triangle=triangle,
        barycentric=stored.barycentric,
        displacement=surface.in_metres(stored.uvd[:, 2], units),
        local_offset=np.zeros((0, 3), np.float32),
        local_quat_wxyz=splats.quat_wxyz if stored.quat_wxyz is None else stored.quat_wxyz,
    )
    if stored.quat_wxyz is None:
        notes.append(fact("no_own_rotation", file=stored.file.name, cloud=NAME))
    shifted = int((stored.uvd[:, :2] != 0).any(axis=1).sum())
    if shifted:
        notes.append(fact("numbers_unused", count=shifted))
    return embedding, mesh_file, notes
