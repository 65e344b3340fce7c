"""Options of `convert` and `pack` that say what is read: one type each, and the arguments that they make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer

from avatar_export.commands import arguments
from avatar_export.options import ReadOptions
from avatar_runtime.rules import ROTATION_RULES, SH_DIRECTIONS, TRAINED_SIGNS

BodyModel = Annotated[Path | None, typer.Option(help="FLAME or SMPL file, .npz or .pkl.")]
BodyScale = Annotated[
    float | None,
    typer.Option(
        help="Gaussian Blendshapes only: how much the body model was enlarged for training, in training units per "
        "unit of its file (a metre). Left out: what rules.json says, else 1.",
        min=1e-6,
        max=1e6,
    ),
]
Shape = Annotated[
    Path | None,
    typer.Option(
        "--shape",
        "--frame",
        help="Identity coefficients: a tracked .frame, .npy, .npz, .json, or `zero` for the mean shape.",
    ),
]
Eyelids = Annotated[Path | None, typer.Option(help="Folder with l_eyelid.npy and r_eyelid.npy.")]
AnchorFaces = Annotated[
    Path | None, typer.Option(help="Text file with the indices of the faces that carry the upper teeth.")
]
Dataset = Annotated[
    Path | None,
    typer.Option(help="Folder that is searched for every input that is not given, driving.json included."),
]
Rig = Annotated[
    Path | None,
    typer.Option(
        help="Rig of the mesh that the Gaussians are embedded in: a skinned .glb or .fbx, or an ASM face .npz."
    ),
]
Mesh = Annotated[
    Path | None,
    typer.Option(
        help="Mesh that the Gaussians are embedded in, if it is not in the checkpoint: .obj, or .npz with vertices "
        "and faces, in training units (see --units). For an ASM person: the face .npz with the template."
    ),
]
Poses = Annotated[
    Path | None,
    typer.Option(
        help="Tracked poses, for the identity and a clip: flame_params.json, poses.npz or flame_param.npz."
    ),
]
Units = Annotated[
    float | None,
    typer.Option(help="Training units per metre (4 for SplattingAvatar heads).", min=1e-6, max=1e6),
]
MeshScaling = Annotated[
    bool | None,
    typer.Option(
        "--mesh-scaling/--no-mesh-scaling",
        help="SplattingAvatar: whether triangles scale their Gaussians. Default: as config.yaml says.",
    ),
]
ShDirection = Annotated[
    str | None,
    typer.Option(help=f"View direction for SH: {' or '.join(SH_DIRECTIONS)}. Default: as the config says."),
]
ShDegree = Annotated[int | None, typer.Option(help="Active SH degree. Default: as stored.", min=0, max=3)]
QuaternionSign = Annotated[
    str | None,
    typer.Option(
        help=f"Sign of pytorch3d's quaternions at training: {' or '.join(TRAINED_SIGNS)} (before 0.7.6)."
    ),
]
NoRig = Annotated[
    bool, typer.Option("--no-rig", help="Write no rig: no joints, no skinning, only expressions.")
]
Rotation = Annotated[
    str | None,
    typer.Option(
        help=f"Rotation rule, where the system leaves a choice: {', '.join(ROTATION_RULES)}.",
    ),
]
Driving = Annotated[Path | None, typer.Option(help="JSON matrix from the ARKit names to this avatar.")]
Clip = Annotated[
    list[Path] | None,
    typer.Option(
        help="File whose clips are added: a face recording (played through the driving), .glb, .fbx or pose file; or "
        "BUNDLE:NAME, a clip of another avatar with the same expressions or ARKit's. May be repeated.",
        metavar="FILE|BUNDLE:NAME",
    ),
]
Exact = Annotated[
    bool, typer.Option("--exact", help="Keep every delta that is not zero, rounding noise included.")
]
Name = Annotated[str | None, typer.Option(help="Name of the avatar. Default: that of the source.")]
Licence = Annotated[str | None, typer.Option(help="Licence of the avatar, for the manifest.")]
Author = Annotated[str | None, typer.Option(help="Author of the avatar, for the manifest.")]
Consent = Annotated[str | None, typer.Option(help="Consent of the person shown, for the manifest.")]


AcceptMisfit = Annotated[
    bool,
    typer.Option(
        "--accept-misfit",
        help="Convert inputs that lie far apart (above a quarter of their size), with a warning in place of an error.",
    ),
]


def read_options(given: Mapping[str, Any]) -> ReadOptions:
    """The options of a reader from a command's arguments, by name. Raises a usage error for a wrong value."""
    arguments.one_of("--sh-direction", given["sh_direction"], SH_DIRECTIONS)
    arguments.one_of("--quaternion-sign", given["quaternion_sign"], TRAINED_SIGNS)
    return ReadOptions(**{field.name: given[field.name] for field in fields(ReadOptions)})
