"""`avatar-export convert`: a trained avatar in, a bundle out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export import conversion
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages, output, print_json
from avatar_export.options import ReadOptions
from avatar_export.provenance import DOUBT
from avatar_export.summary import summary
from avatar_export.writers.table import INFLUENCES
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.handedness import HANDEDNESS
from avatar_runtime.rules import ROTATION_RULES, SH_DIRECTIONS, TRAINED_SIGNS


def convert(
    source: Annotated[
        Path, typer.Argument(help="The output of training: a folder, checkpoint or zip (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Bundle folder to write, or FILE.avatar.zip.")],
    system: arguments.System = None,
    body_model: Annotated[Path | None, typer.Option(help="FLAME or SMPL file, .npz or .pkl.")] = None,
    body_scale: Annotated[
        float,
        typer.Option(
            help="Gaussian Blendshapes only: how much the body model was enlarged for training, in training units per "
            "unit of its file (a metre). 1 if it was not.",
            min=1e-6,
            max=1e6,
        ),
    ] = 1.0,
    shape: Annotated[
        Path | None,
        typer.Option(
            "--shape",
            "--frame",
            help="Identity coefficients: a tracked .frame, .npy, .npz, .json, or `zero` for the mean shape.",
        ),
    ] = None,
    eyelids: Annotated[Path | None, typer.Option(help="Folder with l_eyelid.npy and r_eyelid.npy.")] = None,
    anchor_faces: Annotated[
        Path | None, typer.Option(help="Text file with the indices of the faces that carry the upper teeth.")
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(
            help="Folder that is searched for every input that is not given, driving.json included."
        ),
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Rig of the mesh that the Gaussians are embedded in: a skinned .glb or .fbx, or an ASM face .npz."
        ),
    ] = None,
    mesh: Annotated[
        Path | None,
        typer.Option(
            help="Mesh that the Gaussians are embedded in, if it is not in the checkpoint: .obj, or .npz with vertices "
            "and faces, in training units (see --units). For an ASM person: the face .npz with the template."
        ),
    ] = None,
    poses: Annotated[
        Path | None,
        typer.Option(
            help="Tracked poses, for the identity and a clip: flame_params.json, poses.npz or flame_param.npz."
        ),
    ] = None,
    units: Annotated[
        float | None,
        typer.Option(help="Training units per metre (4 for SplattingAvatar heads).", min=1e-6, max=1e6),
    ] = None,
    mesh_scaling: Annotated[
        bool | None,
        typer.Option(
            "--mesh-scaling/--no-mesh-scaling",
            help="SplattingAvatar: whether triangles scale their Gaussians. Default: as config.yaml says.",
        ),
    ] = None,
    sh_direction: Annotated[
        str | None,
        typer.Option(
            help=f"View direction for SH: {' or '.join(SH_DIRECTIONS)}. Default: as the config says."
        ),
    ] = None,
    sh_degree: Annotated[
        int | None, typer.Option(help="Active SH degree. Default: as stored.", min=0, max=3)
    ] = None,
    quaternion_sign: Annotated[
        str | None,
        typer.Option(
            help=f"Sign of pytorch3d's quaternions at training: {' or '.join(TRAINED_SIGNS)} (before 0.7.6)."
        ),
    ] = None,
    no_rig: Annotated[
        bool, typer.Option("--no-rig", help="Write no rig: no joints, no skinning, only expressions.")
    ] = False,
    rotation: Annotated[
        str | None,
        typer.Option(
            help=f"Rotation rule, where the system leaves a choice: {', '.join(ROTATION_RULES)}.",
        ),
    ] = None,
    driving: Annotated[
        Path | None, typer.Option(help="JSON matrix from the ARKit names to this avatar.")
    ] = None,
    clip: Annotated[
        list[Path] | None,
        typer.Option(
            help="File whose clips are added: a face recording (played through the driving), .glb, .fbx or pose file. "
            "May be repeated."
        ),
    ] = None,
    influences: Annotated[
        int, typer.Option(help="Joints per vertex in rig.glb: 4, or 8 (JOINTS_1).")
    ] = INFLUENCES[0],
    handedness: Annotated[
        str,
        typer.Option(
            help=f"Frame of the normative files: {' or '.join(HANDEDNESS)} (Unity, Unreal). glTF and USD do not change."
        ),
    ] = HANDEDNESS[0],
    exact: Annotated[
        bool, typer.Option("--exact", help="Keep every delta that is not zero, rounding noise included.")
    ] = False,
    name: Annotated[str | None, typer.Option(help="Name of the avatar. Default: that of the source.")] = None,
    licence: Annotated[str | None, typer.Option(help="Licence of the avatar, for the manifest.")] = None,
    author: Annotated[str | None, typer.Option(help="Author of the avatar, for the manifest.")] = None,
    consent: Annotated[
        str | None, typer.Option(help="Consent of the person shown, for the manifest.")
    ] = None,
    no_preview: Annotated[bool, typer.Option("--no-preview", help="Do not draw preview.png.")] = False,
    no_engine_files: Annotated[
        bool, typer.Option("--no-engine-files", help="Do not write glTF, USD and embedding.json.")
    ] = False,
    no_reference: Annotated[
        bool,
        typer.Option("--no-reference", help="Do not write reference/, which `conform` compares ports with."),
    ] = False,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Convert a trained avatar to a bundle."""
    arguments.one_of("--sh-direction", sh_direction, SH_DIRECTIONS)
    arguments.one_of("--quaternion-sign", quaternion_sign, TRAINED_SIGNS)
    arguments.one_of("--influences", influences, INFLUENCES)
    arguments.one_of("--handedness", handedness, HANDEDNESS)
    options = ReadOptions(
        body_model=body_model,
        body_scale=body_scale,
        shape=shape,
        eyelids=eyelids,
        anchor_faces=anchor_faces,
        dataset=dataset,
        no_rig=no_rig,
        rotation=rotation,
        exact=exact,
        name=name,
        rig=rig,
        mesh=mesh,
        poses=poses,
        units=units,
        mesh_scaling=mesh_scaling,
        sh_direction=sh_direction,
        sh_degree=sh_degree,
        quaternion_sign=quaternion_sign,
    )
    with Steps() as step:
        written = conversion.convert(
            source,
            out,
            options=options,
            system=system,
            driving=driving,
            clips=clip or (),
            licence=licence,
            author=author,
            consent=consent,
            preview=not no_preview,
            engine_files=not no_engine_files,
            reference=not no_reference,
            influences=influences,
            handedness=handedness,
            force=force,
            progress=step,
        )
        step("reading the bundle again")
        avatar, manifest = load(written), read_manifest(opener(written))
    size = sum(entry["bytes"] for entry in manifest["files"])
    if as_json:
        print_json({"out": str(out), "bytes": size, "handedness": handedness, **summary(avatar)})
        return
    output.print(f"{out}: {_contents(avatar)}, {size / 1e6:.1f} MB{', left-handed' * (handedness == 'left')}")
    notes = conversion.conversion_notes(avatar, manifest)
    for note in [*notes, *conversion.unstored_notes(source, options, system)]:
        doubt = note.startswith(DOUBT)
        messages.print(f"warning: {note.removeprefix(DOUBT)}" if doubt else f"note: {note}")


def _contents(avatar: Avatar) -> str:
    """`1000 Gaussians, 50 expressions, 2 clips`."""
    count = len(avatar.clips)
    clips = f", {count} clip{'s' * (count > 1)}" if count else ""
    return f"{avatar.gaussians.count} Gaussians, {len(avatar.expressions)} expressions{clips}"
