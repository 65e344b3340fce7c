"""`avatar-train asm`: bone-driven faces (arXiv 2304.09423), fitted to scans and to images."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from avatar_export import ReadOptions, read
from avatar_export.asm import NEUTRAL, AsmFace, Binding, check_names, load, save
from avatar_export.commands import arguments, console
from avatar_export.writers import bundle
from avatar_runtime import AvatarError
from avatar_runtime.io import of_file
from avatar_trainer.asm.align import Scan
from avatar_trainer.asm.register.fit import Registration, register_takes, scan_error, template_keypoints
from avatar_trainer.asm.register.settings import RegisterSettings
from avatar_trainer.asm.scan_files import expect_eyes, expect_on_scan, read_keypoints, read_scan
from avatar_trainer.asm.template.files import template_of
from avatar_trainer.asm.template.make import initial_binding
from avatar_trainer.asm.template.weights import initial_weights
from avatar_trainer.asm.views.files import read as read_views
from avatar_trainer.asm.views.fit import ViewSettings, as_face
from avatar_trainer.asm.views.fit import fit as fit_views
from avatar_trainer.commands.places import expect_bundle_place, expect_room
from avatar_trainer.loop.machine import disk_advice, memory_advice, reproducible
from avatar_trainer.settings import with_values

app = typer.Typer(
    help="ASM: bone-driven faces, fitted to scans and images.", no_args_is_help=True, rich_markup_mode=None
)

Out = Annotated[Path, typer.Option("--out", "-o", help="Face to write, FACE.npz.")]
TemplateFile = Annotated[
    Path, typer.Option("--template", help="Face to begin with, .npz: a topology with bones and mixtures.")
]
Components = Annotated[
    int | None, typer.Option(help="Mixture components K of a bone; default: the template's.", min=1, max=16)
]
Bundle = Annotated[Path | None, typer.Option(help="Bundle to write of the face, too.", metavar="BUNDLE")]
Force = Annotated[bool, typer.Option("--force", help="Replace FACE.npz and BUNDLE if they exist.")]


@app.callback()
def asm() -> None:
    """ASM: bone-driven faces, fitted to scans and images."""


@app.command()
def scan(
    neutral: Annotated[
        Path,
        typer.Argument(help="Scan of the neutral face: .obj, .ply, .stl, .off, .glb, .npz.", metavar="SCAN"),
    ],
    template: TemplateFile,
    keypoints: Annotated[
        Path, typer.Option(help="JSON of the scan's seven keypoints, NAME: [x, y, z] in its frame.")
    ],
    out: Out,
    expression: Annotated[
        list[Path] | None,
        typer.Option(
            help="Scan of an expression, may be repeated; its keypoints from SCAN.json beside it, else --keypoints."
        ),
    ] = None,
    units: Annotated[
        float, typer.Option(help="Units of the scans in a metre; 0: found by the keypoints.", min=0, max=1e6)
    ] = 1.0,
    components: Components = None,
    set_: Annotated[list[str] | None, typer.Option("--set", help="NAME=VALUE: a setting of the fit.")] = None,
    export: Bundle = None,
    force: Force = False,
) -> None:
    """Fit a bone-driven face to a scan, and its poses to scans of expressions."""
    settings = with_values(RegisterSettings(similarity=units == 0), arguments.pairs(set_, "--set"))
    _expect_places(out, export, force)
    with console.Steps() as step, memory_advice():
        step("reading")
        start = load(template)
        with of_file(template):
            template_keypoints(start.template)
        scans = _scans([neutral, *(expression or [])], keypoints, units)
        step("preparing")
        binding = with_components(start, components)
        step(f"fitting, {settings.iterations} iterations")
        with reproducible(settings.seed, threads=0):
            found = register_takes(start.template, binding, scans, settings)
        write_face(found.face, out)
        if export is not None:
            step(f"writing {export}")
            with disk_advice(export):
                bundle.write_bundle(read(out, ReadOptions(name=found.face.name)), export, force=force)
    console.output.print(f"{out}: {len(start.template.bone_names)} bones, {len(scans)} takes")
    console.output.print(console.facts_table(_errors(found, scans)))


@app.command()
def views(
    folder: Annotated[Path, typer.Argument(help="Folder of images with views.json.")],
    template: TemplateFile,
    out: Out,
    components: Components = None,
    set_: Annotated[list[str] | None, typer.Option("--set", help="NAME=VALUE: a setting of the fit.")] = None,
    force: Force = False,
) -> None:
    """Fit a bone-driven face to images of a still head from many sides; their cameras' poses are found, too."""
    settings = with_values(ViewSettings(), arguments.pairs(set_, "--set"))
    _expect_places(out, None, force)
    with console.Steps() as step, memory_advice():
        step("reading")
        start, images = load(template), read_views(folder)
        step("preparing")
        binding = with_components(start, components)
        step(f"fitting {len(images.mask)} views, {settings.iterations} iterations")
        with reproducible(0, threads=0):
            found = fit_views(start.template, binding, images, settings)
        write_face(as_face(found, start.template, images.name), out)
    console.output.print(f"{out}: {len(start.template.bone_names)} bones from {len(images.mask)} views")


@app.command()
def template(
    mesh: Annotated[
        Path,
        typer.Argument(
            help="Head without eyes and teeth, open at the neck: .obj, .npz, .ply, .off, .glb, .stl."
        ),
    ],
    landmarks: Annotated[
        Path,
        typer.Option(help="JSON list of iBUG's 68 landmarks: vertices, or [x, y, z] in the mesh's unit."),
    ],
    out: Out,
    units: Annotated[float, typer.Option(help="Units of the mesh in a metre.", min=1e-6, max=1e6)] = 1.0,
    components: Annotated[int, typer.Option(help="Mixture components K of a bone.", min=1, max=16)] = 2,
    force: Force = False,
) -> None:
    """Make a template of a head mesh: 84 bones placed by landmarks, with first weights. +Y up, face +Z."""
    _expect_places(out, None, force)
    with console.Steps() as step, memory_advice():
        step("placing bones")
        with reproducible(0, threads=0):
            found = template_of(mesh, landmarks, units, components)
        write_face(found, out)
    console.output.print(
        f"{out}: {len(found.template.bone_names)} bones, {len(found.template.vertices)} vertices"
    )


def with_components(face: AsmFace, components: int | None) -> Binding:
    """A face's binding; for another number of components, mixtures fitted to the first weights of its bones."""
    if components is None or components == face.binding.components:
        return face.binding
    template = face.template
    weights = initial_weights(template.vertices, template.triangles, template.rest_position)
    return initial_binding(template, weights, components)


def write_face(face: AsmFace, out: Path) -> None:
    """Write FACE.npz whole or not at all."""
    partial = out.with_name(f".{out.name}.{os.getpid()}.partial")
    try:
        with disk_advice(out):
            out.parent.mkdir(parents=True, exist_ok=True)
            save(face, partial)
            partial.replace(out)
    except AvatarError as error:
        raise AvatarError(error.message, file=out, field=error.field) from None
    finally:
        with suppress(OSError):
            partial.unlink()


def _expect_places(out: Path, export: Path | None, force: bool) -> None:
    """Raise AvatarError if FACE.npz or the bundle cannot be written, before anything is computed."""
    if out.suffix.lower() != ".npz":
        raise AvatarError("does not end in .npz; a face is written as .npz", file=out)
    if out.is_dir() or (out.exists() and not force):
        raise AvatarError("is a folder" if out.is_dir() else "exists; pass --force to replace it", file=out)
    expect_room(out.parent)
    if export is not None:
        expect_bundle_place(export, out, force=force)


def _scans(paths: list[Path], keypoints: Path, units: float) -> list[Scan]:
    """The scans in metres, or in their own unit if `units` is 0."""
    for count, path in enumerate(paths):
        with of_file(path):
            check_names(paths[0].stem, [NEUTRAL, *(p.stem for p in paths[1 : count + 1])])
    found = []
    for path in paths:
        own = path.with_suffix(".json")
        marks_file = own if path is not paths[0] and own.is_file() else keypoints
        marks = read_keypoints(marks_file)
        given = read_scan(path, marks)
        expect_on_scan(given, marks_file)
        if units:
            expect_eyes(marks["right_eye_outer"] / units, marks["left_eye_outer"] / units, marks_file)
        unit = units or 1.0
        placed = {name: place / unit for name, place in marks.items()}
        found.append(replace(given, points=given.points / unit, keypoints=placed))
    return found


def _errors(found: Registration, scans: list[Scan]) -> dict[str, str]:
    errors = [scan_error(found, given, i).mean_mm for i, given in enumerate(scans)]
    takes = zip(found.face.takes, errors, strict=True)
    return {take.name: f"scan to mesh {error:.3f} mm" for take, error in takes}
