"""`avatar-export convert`: a trained avatar in, a bundle out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export import conversion
from avatar_export.commands import arguments, inputs
from avatar_export.commands.console import Steps, messages, output, print_json
from avatar_export.packing.make import Choices, make_pack
from avatar_export.provenance import DOUBT
from avatar_export.summary import summary
from avatar_export.writers.table import INFLUENCES
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.handedness import HANDEDNESS
from avatar_runtime.io.text_files import refuse_existing


def convert(
    source: Annotated[
        Path, typer.Argument(help="The output of training: a folder, checkpoint or zip (see `systems`).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="Bundle folder to write, or FILE.avatar.zip.")],
    system: arguments.System = None,
    body_model: inputs.BodyModel = None,
    body_scale: inputs.BodyScale = None,
    shape: inputs.Shape = None,
    eyelids: inputs.Eyelids = None,
    anchor_faces: inputs.AnchorFaces = None,
    dataset: inputs.Dataset = None,
    rig: inputs.Rig = None,
    mesh: inputs.Mesh = None,
    poses: inputs.Poses = None,
    units: inputs.Units = None,
    mesh_scaling: inputs.MeshScaling = None,
    sh_direction: inputs.ShDirection = None,
    sh_degree: inputs.ShDegree = None,
    quaternion_sign: inputs.QuaternionSign = None,
    no_rig: inputs.NoRig = False,
    accept_misfit: inputs.AcceptMisfit = False,
    rotation: inputs.Rotation = None,
    driving: inputs.Driving = None,
    clip: inputs.Clip = None,
    influences: Annotated[
        int, typer.Option(help="Joints per vertex in rig.glb: 4, or 8 (JOINTS_1).")
    ] = INFLUENCES[0],
    handedness: Annotated[
        str,
        typer.Option(
            help=f"Frame of the normative files: {' or '.join(HANDEDNESS)} (Unity, Unreal). glTF and USD do not change."
        ),
    ] = HANDEDNESS[0],
    exact: inputs.Exact = False,
    name: inputs.Name = None,
    licence: inputs.Licence = None,
    author: inputs.Author = None,
    consent: inputs.Consent = None,
    no_preview: Annotated[bool, typer.Option("--no-preview", help="Do not draw preview.png.")] = False,
    no_engine_files: Annotated[
        bool, typer.Option("--no-engine-files", help="Do not write glTF, USD and embedding.json.")
    ] = False,
    no_reference: Annotated[
        bool,
        typer.Option("--no-reference", help="Do not write reference/, which `conform` compares ports with."),
    ] = False,
    pack: Annotated[Path | None, typer.Option(help="NAME.avatar to write too: see `pack`.")] = None,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Convert a trained avatar to a bundle."""
    options = inputs.read_options(locals())
    if pack is not None:
        refuse_existing(pack, force)
    arguments.one_of("--influences", influences, INFLUENCES)
    arguments.one_of("--handedness", handedness, HANDEDNESS)
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
        if pack is not None:
            make_pack(avatar, pack, Choices(handedness=handedness), force=force, progress=step)
    size = sum(entry["bytes"] for entry in manifest["files"])
    if as_json:
        print_json({"out": str(out), "bytes": size, "handedness": handedness, **summary(avatar)})
        return
    output.print(f"{out}: {_contents(avatar)}, {size / 1e6:.1f} MB{', left-handed' * (handedness == 'left')}")
    notes = conversion.conversion_notes(avatar, manifest)
    chosen = conversion.chosen_notes(avatar, source, options, system)
    for note in [*notes, *conversion.unstored_notes(source, options, system), *chosen]:
        doubt = note.startswith(DOUBT)
        messages.print(f"warning: {note.removeprefix(DOUBT)}" if doubt else f"note: {note}")


def _contents(avatar: Avatar) -> str:
    """`1000 Gaussians, 50 expressions, 2 clips`."""
    count = len(avatar.clips)
    clips = f", {count} clip{'s' * (count > 1)}" if count else ""
    return f"{avatar.gaussians.count} Gaussians, {len(avatar.expressions)} expressions{clips}"
