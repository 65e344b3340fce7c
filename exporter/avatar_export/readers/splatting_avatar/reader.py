"""SplattingAvatar (initialneil/SplattingAvatar 3847314): Gaussians embedded in a triangle mesh.

Scale, opacity and colour come from point_cloud.ply; its x y z and rot_* are those of the first training frame
and follow from the embedding. The mesh is that of this frame, as text with six decimals in embedding.obj.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.fit.judge import length
from avatar_export.formats.mesh_files import read_mesh
from avatar_export.formats.point_cloud import (
    NAME,
    PointCloud,
    chosen_iteration,
    locate,
    read_ply,
    refuse_incomplete,
)
from avatar_export.notes import DOUBT, UNSAID, Note, Setting
from avatar_export.options import ReadOptions
from avatar_export.provenance import source_files
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
SCALES = {True: "log_area", False: "none"}  # of model.with_mesh_scaling
SCALING = {"log_area": "on", "none": "off"}  # as the note says it; other rules by their name
DIRECTIONS = {True: "inverse_rotation", False: "world"}  # of pipe.convert_SHs_python
PLAYED_RULES = {  # of rules.json
    "scale": AREA_SCALES,
    "position": NORMAL_POSITIONS,
    "rotation": VERTEX_ROTATIONS,
    "sh_direction": SH_DIRECTIONS,
}
RECORDED_RULES = {"embedding": ("walking", "clamped", "fixed", "released")}
APART = 0.01  # of the avatar's size


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


def chosen(path: Path, options: ReadOptions) -> list[str]:
    """The iteration that `read` takes."""
    return chosen_iteration(path, _complete)


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError for missing files and unsound data."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "this system has no such input or choice")
        options.refuse_beside_no_rig(RIG_INPUTS, SYSTEM)
        cloud = locate(path, _complete)
        found = None if cloud is None else find_embedding(cloud)
        if cloud is None or found is None:
            raise AvatarError(f"has no {NAME} with {' or '.join(FORMS)} beside it", file=path)
        refuse_incomplete(path, cloud, f"{NAME} and {' or '.join(FORMS)}")
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
        if rig.fits and units.source == UNSAID:  # the unit is shown to be right
            units = replace(units, source="assumed; the rig fits so")
        notes = [Note("settings", {"settings": (units, *others)}), *trained.notes(), *notes]
        notes += surface.fit_notes(avatar, options, mesh_file, SYSTEM)
        notes += [*_position_notes(avatar, splats), *rig.notes]
        files = {NAME: cloud.file, found.name: found, mesh_file.name: mesh_file, **rig.files}
        files |= {} if config.file is None else {CONFIG: config.file}
        files |= {} if trained.file is None else {RULES_FILE: trained.file}
        return replace(
            avatar,
            provenance={
                "system": SYSTEM,
                "source_commit": "initialneil/SplattingAvatar 3847314",
                "form": found.name,
                "source_files": source_files(files),
                "notes": notes,
            },
        )


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
    played = trained.played
    kind = config.get("dataset", "frameset_type", str)
    preset = PRESETS.get(kind, OTHERWISE)
    assumed = f"assumed, usual for {kind}" if kind in PRESETS else UNSAID

    def choose(
        option: object, flag: str, rule: str | None, field: str, fallback: tuple[Any, str]
    ) -> tuple[Any, str]:
        if option is not None:
            return option, flag
        if rule is not None:
            return rule, RULES_FILE
        section, key = field.split(".")
        value = config.get(section, key, type(fallback[0]))
        return fallback if value is None else (value, f"{CONFIG} {field}")

    units, units_by = preset.units, assumed
    if trained.units is not None:
        units, units_by = trained.units, RULES_FILE
    if options.units is not None:
        units, units_by = options.units, "--units"
    usual = preset.mesh_scaling, assumed
    scale, scale_by = choose(
        options.mesh_scaling, "--mesh-scaling", played.get("scale"), "model.with_mesh_scaling", usual
    )
    scale = SCALES.get(scale, scale)
    scaling = SCALING.get(scale, scale.removesuffix("_area"))
    usual = False, "assumed, the code's default"
    direction, direction_by = choose(
        options.sh_direction, "--sh-direction", played.get("sh_direction"), "pipe.convert_SHs_python", usual
    )
    direction = DIRECTIONS.get(direction, direction)
    stored = splats.sh_degree, NAME
    degree, degree_by = choose(options.sh_degree, "--sh-degree", None, "model.sh_degree", stored)
    carried = {name: played[name] for name in ("position", "rotation") if name in played}
    return Settings(
        surface.units_of(units),
        Rules(
            position=carried.get("position", "normal"),
            rotation=carried.get("rotation", "vertex_quaternion"),
            scale=scale,
            sh_direction=direction,
            quaternion_sign=options.quaternion_sign or "w_positive",
        ),
        surface.degree_of(degree, splats, cloud.file, degree_by),
        (
            Setting(f"{units:g} training units a metre", units_by),
            Setting(f"mesh scaling {scaling}", scale_by),
            Setting(f"SH direction {direction}", direction_by),
            Setting(f"SH degree {degree}", degree_by),
            *(Setting(f"{name} {value}", RULES_FILE) for name, value in carried.items()),
        ),
    )


def _embedding(
    stored: StoredEmbedding, splats: Gaussians, options: ReadOptions, units: float
) -> tuple[Embedding, Path, list[str | Note]]:
    """(embedding in metres, file of its mesh, notes)."""
    mesh_file = options.mesh or stored.mesh
    if options.mesh is None and not os.path.isfile(mesh_file):
        raise AvatarError(
            f"names {stored.mesh_as_named[:80]!a}, but there is no {stored.mesh.name!a} beside it; pass --mesh",
            file=stored.file,
        )
    mesh = read_mesh(mesh_file)
    triangle = surface.triangle_rows(stored.triangle, mesh, stored.file, "sample_fidxs")
    notes: list[str | Note] = [
        *surface.check_barycentric(stored.barycentric, stored.file, stored.weights_key)
    ]
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
        notes.append(f"no _rotation in {stored.file.name}: rot_* of {NAME} is taken")
    shifted = int((stored.uvd[:, :2] != 0).any(axis=1).sum())
    if shifted:
        notes.append(
            f"_xyz of {shifted} Gaussians has first numbers that are not 0; the release uses the third alone"
        )
    return embedding, mesh_file, notes


def _position_notes(avatar: Avatar, splats: Gaussians) -> list[str]:
    """A doubt about the mesh if the Gaussians of the .ply, saved in the same frame, have other positions."""
    mean = surface.in_metres(splats.mean, avatar.training_per_bundle)
    with np.errstate(all="ignore"):
        apart = float(np.median(np.linalg.norm(mean - avatar.gaussians.mean, axis=1)))
        size = float(np.ptp(avatar.gaussians.mean, axis=0).max())
    if not apart > APART * size:
        return []
    return [
        f"{DOUBT}x y z of {NAME} lie {length(apart)} (median) from the embedding: another frame's, or not "
        "its mesh"
    ]
