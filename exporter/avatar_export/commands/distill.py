"""`avatar-export distill`, `check` and `poses`: posed dumps of any code in, a bundle out; and what to dump."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.subject_files import read_shape
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, output, tell
from avatar_export.commands.declared import command
from avatar_export.distill import drivers, make
from avatar_export.distill.dumps.folder import OWNER
from avatar_export.distill.poses import DEGREES, driven, poses_to_dump
from avatar_export.distill.prepare import prepared
from avatar_export.distill.report import report_html
from avatar_export.notes.note import fact
from avatar_export.notes.text import text
from avatar_export.options import Author, BodyModel, Consent, License, Option, Shape
from avatar_export.provenance import with_rights
from avatar_export.rigs.rig_file import read_rig_file
from avatar_export.writers.bundle import may_replace, write_bundle
from avatar_runtime.avatar import Rig
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import owned
from avatar_runtime.io.text_files import refuse_existing, write_text

REPORT = ".report.html"

Dumps = Annotated[Path, typer.Argument(help="Folder with dumps.json, drivers.npz and frames/00000.ply ...")]


@command
def distill(
    dumps: Dumps,
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help=f"Bundle folder to write, or FILE.avatar.zip; OUT{REPORT} is put beside it."
        ),
    ],
    body_model: BodyModel = None,
    shape: Annotated[
        Path | None,
        typer.Option(help="Identity coefficients for --body-model: a tracked .frame, .npy, .npz or .json."),
    ] = None,
    rig: Annotated[
        Path | None,
        typer.Option(help="Rig that posed the dumps: a skinned .glb or .fbx, or an ASM face .npz."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Learn, measure and write the report, but no bundle.")
    ] = False,
    accept_error: Annotated[
        bool,
        typer.Option(
            "--accept-error", help="Write the bundle although held-out frames are far off, with a warning."
        ),
    ] = False,
    license: License = None,
    author: Author = None,
    consent: Consent = None,
    force: arguments.Force = False,
) -> None:
    """Learn a portable avatar from posed dumps of any code; its error is measured on held-out frames."""
    arguments.exclude({"--body-model": body_model, "--rig": rig})
    report = out.with_name(out.name.removesuffix(".zip").removesuffix(".avatar") + REPORT)
    refuse_existing(report, force)
    if not dry_run:
        may_replace(out, force)
    with Steps() as step:
        found, names = _rig(body_model, shape, rig)
        result = make.distill(
            dumps,
            rig=found,
            morph_names=names,
            accept_error=accept_error,
            written=lambda result: write_text(report, report_html(result), force=force),
            progress=step,
        )
        if not dry_run:
            avatar = with_rights(result.avatar, license, author, consent)
            write_bundle(avatar, out, force=force, progress=lambda file: step(f"writing {file}"))
    errors = result.errors
    measured = "baked, an upper bound" if result.form == make.BAKED else "held out"
    output.print(
        f"{report if dry_run else out}: {result.form}, {errors.rms:.3g} mm, {errors.decibels:.1f} dB in the foreground "
        f"({measured})"
    )
    tell([*make.mended_notes(result.checked), result.reason, *result.doubts])


def check(dumps: Dumps) -> None:
    """Judge posed dumps for `distill`: what is wrong, what would be mended, what is doubtful."""
    try:
        with Steps() as step, owned(OWNER):
            found = prepared(dumps, progress=step)
    except AvatarError:
        if dumps.is_dir():  # else there are none to judge
            output.print(f"{dumps}: " + text(fact("unfit")))
        raise
    seen, mended = found.checked.dumps.drivers, found.checked.mended
    output.print(
        f"{dumps}: {seen.frames} frames of {found.task.layout.rows} Gaussians in "
        f"{len(np.unique(seen.take))} takes, {len(seen.joint_names)} joints, {len(seen.driver_names)} drivers"
    )
    for note in mended:
        output.print(f"would be mended: {text(note)}")
    for note in found.doubts:
        output.print(f"warning: {text(note)}")
    verdict = fact("fit_doubtful") if found.doubts else fact("fit_mended") if mended else fact("fit")
    output.print(f"{dumps}: {text(verdict)}")


@command
def poses(
    source: Annotated[
        Path,
        typer.Argument(
            help="The body model that drives the avatar (FLAME, SMPL, SMPL-X: .npz or .pkl), or its rig "
            "(.glb, .fbx, ASM face .npz).",
            metavar="BODY|RIG",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="FILE.npz to write.")],
    shape: Shape = None,
    frames: Annotated[
        int | None,
        typer.Option(
            help="Number of random frames. Default: as many as the others, at least 60.", min=0, max=10_000
        ),
    ] = None,
    degrees: Annotated[
        float,
        Option(
            "How far a joint turns about each of its axes. Jaw and eyes have ranges of their own; roots stay.",
            least=0,
            most=90,
        ),
    ] = DEGREES,
    seed: Annotated[int, typer.Option(help="Seed of the random frames.", min=0, max=2**31)] = 0,
    force: arguments.Force = False,
) -> None:
    """Write the poses and expressions that a code should dump, so that an avatar can be learnt from them.

    The frames show each driver alone, each joint alone at the ends of its range, and random mixtures.
    """
    refuse_existing(out, force)
    made = poses_to_dump(driven(source, shape, degrees), frames, seed)
    drivers.write(made, out, force=force)
    takes = ", ".join(str(count) for count in np.bincount(made.take))
    output.print(
        f"{out}: {made.frames} frames of {len(made.driver_names)} drivers and {len(made.joint_names)} joints, "
        f"in takes of {takes}"
    )


def _rig(body_model: Path | None, shape: Path | None, rig: Path | None) -> tuple[Rig | None, tuple[str, ...]]:
    """The rig with a mesh and the names of its morphs; None where no file is given."""
    if body_model is not None:
        body = read_body_model(body_model)
        return bake_rig(body, None if shape is None else read_shape(shape)), body.expression_names
    if shape is not None:
        raise typer.BadParameter("goes with --body-model", param_hint="--shape")
    if rig is None:
        return None, ()
    read = read_rig_file(rig)
    return read.rig, read.morph_names
