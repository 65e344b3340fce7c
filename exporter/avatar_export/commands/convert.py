"""`avatar-export convert`: a trained avatar in, a bundle out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from avatar_export.bodies.inputs import found_driving
from avatar_export.clips.sources import clips_from
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages, output, print_json
from avatar_export.commands.summary import summary
from avatar_export.driving.drive import driving_notes
from avatar_export.driving.matrix import with_driving
from avatar_export.options import ReadOptions
from avatar_export.provenance import DOUBT, with_rights
from avatar_export.readers.table import read
from avatar_export.writers import INFLUENCES
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.handedness import HANDEDNESS
from avatar_runtime.rules import ROTATION_RULES, SH_DIRECTIONS, TRAINED_SIGNS

VISIBLE_MM = 0.1


def convert(
    source: Annotated[
        Path, typer.Argument(help="What training left: a folder, checkpoint or zip (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Bundle folder to write, or FILE.avatar.zip.")],
    system: arguments.System = None,
    body_model: Annotated[Path | None, typer.Option(help="FLAME- or SMPL-layout .npz or .pkl.")] = None,
    body_scale: Annotated[
        float, typer.Option(help="Training units in one unit of the body model.", min=1e-6, max=1e6)
    ] = 1.0,
    shape: Annotated[
        Path | None,
        typer.Option("--shape", "--frame", help="Identity: tracked .frame, .npy, .npz, .json, or `zero`."),
    ] = None,
    eyelids: Annotated[Path | None, typer.Option(help="Folder with l_eyelid.npy and r_eyelid.npy.")] = None,
    anchor_faces: Annotated[
        Path | None, typer.Option(help="Face indices that carry the upper teeth (.txt).")
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(help="Folder to search for the inputs that are not given, driving.json too."),
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(
            help="Skinned .glb or .fbx, or ASM face .npz, of the mesh that the Gaussians are embedded in."
        ),
    ] = None,
    mesh: Annotated[
        Path | None,
        typer.Option(
            help="That mesh itself, .obj or .npz (vertices, faces), training units, where it is not stored; "
            "for an ASM person's small file a face .npz with the template."
        ),
    ] = None,
    poses: Annotated[
        Path | None,
        typer.Option(help="flame_params.json, poses.npz or flame_param.npz: identity, and a clip."),
    ] = None,
    units: Annotated[
        float | None,
        typer.Option(help="Training units in a metre (4 for SplattingAvatar heads).", min=1e-6, max=1e6),
    ] = None,
    mesh_scaling: Annotated[
        bool | None,
        typer.Option("--mesh-scaling/--no-mesh-scaling", help="SplattingAvatar; default: its config."),
    ] = None,
    sh_direction: Annotated[
        str | None, typer.Option(help=f"{' or '.join(SH_DIRECTIONS)}; default: as the config says.")
    ] = None,
    sh_degree: Annotated[int | None, typer.Option(help="Active SH degree.", min=0, max=3)] = None,
    quaternion_sign: Annotated[
        str | None,
        typer.Option(help=f"{' or '.join(TRAINED_SIGNS)} (pytorch3d before 0.7.6) at training."),
    ] = None,
    no_rig: Annotated[bool, typer.Option("--no-rig", help="Expressions only: no joints, no skin.")] = False,
    rotation: Annotated[
        str | None,
        typer.Option(help=f"Rotation rule where a system leaves it open: {', '.join(ROTATION_RULES)}."),
    ] = None,
    driving: Annotated[
        Path | None, typer.Option(help="JSON matrix from the ARKit names to this avatar.")
    ] = None,
    clip: Annotated[
        list[Path] | None,
        typer.Option(
            help="Recording (played through --driving), .glb, .fbx or pose file to carry along as a clip; may "
            "be repeated."
        ),
    ] = None,
    influences: Annotated[
        int, typer.Option(help="Joints a vertex of rig.glb has: 4, or 8 (JOINTS_1).")
    ] = INFLUENCES[0],
    handedness: Annotated[
        str,
        typer.Option(
            help=f"Frame of the normative files: {' or '.join(HANDEDNESS)} (Unity, Unreal). Those for engines stay."
        ),
    ] = HANDEDNESS[0],
    exact: Annotated[bool, typer.Option("--exact", help="Keep deltas that are mere rounding noise.")] = False,
    name: Annotated[str | None, typer.Option(help="Name of the avatar.")] = None,
    licence: Annotated[str | None, typer.Option(help="Licence of the avatar, for the manifest.")] = None,
    author: Annotated[str | None, typer.Option(help="Who made it, for the manifest.")] = None,
    consent: Annotated[
        str | None, typer.Option(help="What the person shown agreed to, for the manifest.")
    ] = None,
    no_preview: Annotated[bool, typer.Option("--no-preview", help="Do not draw preview.png.")] = False,
    no_engine_files: Annotated[
        bool, typer.Option("--no-engine-files", help="Write no glTF, USD and JSON.")
    ] = False,
    no_reference: Annotated[
        bool, typer.Option("--no-reference", help="Write no vectors and pictures for ports (`conform`).")
    ] = False,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Write the bundle of a trained avatar."""
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
        step("reading")
        avatar = with_rights(read(source, options, system), licence, author, consent)
        driving = driving or found_driving(dataset)
        if driving is not None:
            avatar = with_driving(avatar, driving).check()
        for path in clip or ():
            step(f"reading {path.name}")
            avatar = replace(avatar, clips=(*avatar.clips, *clips_from(avatar, path))).check()
        manifest = write_bundle(
            avatar,
            out,
            preview=not no_preview,
            engine_files=not no_engine_files,
            reference=not no_reference,
            influences=influences,
            handedness=handedness,
            force=force,
            progress=lambda file: step(f"writing {file}"),
        )
    size = sum(entry["bytes"] for entry in manifest["files"])
    if as_json:
        print_json({"out": str(out), "bytes": size, "handedness": handedness, **summary(avatar)})
        return
    count = len(avatar.clips)
    clips = f", {count} clip{'s' * (count > 1)}" if count else ""
    output.print(
        f"{out}: {avatar.gaussians.count} Gaussians, {len(avatar.expressions)} expressions{clips}, "
        f"{size / 1e6:.1f} MB{', left-handed' if handedness == 'left' else ''}"
    )
    notes = [*_notes(avatar), *_engine_notes(manifest["engine"] or {})]
    for note in sorted(notes, key=lambda text: not text.startswith(DOUBT)):
        doubt = note.startswith(DOUBT)
        messages.print(f"warning: {note.removeprefix(DOUBT)}" if doubt else f"note: {note}")


def _engine_notes(engine: Mapping[str, Any]) -> list[str]:
    """What the files for engines lose, where it can be seen."""
    reasons = {
        "truncation_mm": f"{engine.get('influences')} joints a vertex are too few (--influences 8 gives more)",
        "late_morph_mm": "eyelids move before the skeleton there",
        "shear_mm": "nodes cannot shear",
    }
    return [
        f"rig.glb is up to {engine[name]:.2g} mm from the runtime's mesh, since {reason}"
        for name, reason in reasons.items()
        if engine.get(name, 0) > VISIBLE_MM
    ]


def _notes(avatar: Avatar) -> list[str]:
    notes = []
    dropped = avatar.provenance.get("face_rows_dropped")
    if dropped:
        notes.append(f"{len(dropped)} rows with a NaN or infinity were dropped; avatar.json lists them")
    if avatar.rig is None and avatar.embedding is None:
        notes.append("no rig: expressions only, joints and teeth do not move")
    notes.extend(driving_notes(avatar))
    notes.extend(avatar.provenance.get("notes", ()))
    return notes
