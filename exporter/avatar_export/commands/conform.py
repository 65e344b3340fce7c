"""`avatar-export conform`: a bundle's own reference against a backend, or against what a port gave."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Column, Table

from avatar_export.checks.reference import named_in_full, read_reference
from avatar_export.commands import arguments
from avatar_export.commands.conform_report import (
    COLUMNS,
    Line,
    facts,
    failed_pictures,
    html_report,
    notes,
    stage_lines,
    verdict,
    worst_elements,
)
from avatar_export.commands.console import Steps, messages, output, print_json
from avatar_export.images import Pixels, png
from avatar_export.readers.table import expect_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import BACKENDS, default_backend
from avatar_runtime.bundle import load, opener, read_manifest
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import Reference, Report, conform_outputs
from avatar_runtime.conformance import conform as run_conform
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.text_files import refuse_existing, write_text

MOST_BYTES = 64 << 20  # of a port's outputs; a reference has tenths of that
FILE_WIDTH = 120  # characters a line where no terminal says how many there are


def conform(
    bundle: Annotated[Path, typer.Argument(help="A bundle folder or .avatar.zip.")],
    backend: arguments.Backend = None,
    outputs: Annotated[
        Path | None,
        typer.Option(
            help="FILE.safetensors: what a port gave, by the names that cases.json has for outputs; nothing is played."
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="FILE.html to write: tables and pictures.")] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(help="Folder for pictures of cases that fail: reference, drawn, difference."),
    ] = None,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Play a bundle's reference vectors stage by stage on a backend; exit code 1 if anything is off."""
    arguments.one_of("--backend", backend, BACKENDS)
    arguments.exclude({"--outputs": outputs, "--backend": backend})
    if report is not None:
        refuse_existing(report, force)
    if pictures is not None and pictures.exists():
        raise AvatarError("exists; name another (a folder is never replaced)", file=pictures)
    with Steps() as step:
        step("loading")
        expect_bundle(bundle)
        avatar = load(bundle, as_stored=True)
        read = opener(bundle)
        reference = read_reference(read_manifest(read), read)
        step("playing" if outputs is None else "comparing")
        with named_in_full():
            if outputs is None:
                found = run_conform(avatar, reference, backend or default_backend())
            else:
                found = _given(avatar, reference, outputs)
    if report is not None:
        who = f"outputs {outputs.name}" if outputs is not None else f"backend {found.backend}"
        write_text(report, html_report(f"{avatar.name}, {who}", found, reference))
        messages.print(f"{report}: tables and pictures")
    drawn = failed_pictures(found)
    if pictures is not None and drawn:
        _save(pictures, drawn)
    if pictures is not None:
        messages.print(
            f"{pictures}: {len(drawn)} pictures of what fails" if drawn else "no picture fails: none written"
        )
    if as_json:
        print_json(facts(found, reference))
    else:
        wide = output if output.is_terminal else Console(highlight=False, markup=False, width=FILE_WIDTH)
        lines = stage_lines(found, reference)
        wide.print(_table(lines))
        for text in worst_elements(lines):
            output.print(text, soft_wrap=True)
        output.print(f"{verdict(found)}; made by {reference.made_by}")
        for note in notes(found, reference):
            messages.print(f"note: {note}")
    raise typer.Exit(0 if found.passed else 1)


def _given(avatar: Avatar, reference: Reference, file: Path) -> Report:
    """What the outputs in a file are worth; errors name the file."""
    try:
        if file.stat().st_size > MOST_BYTES:
            raise AvatarError(f"is {file.stat().st_size} bytes, expected at most {MOST_BYTES}")
        return conform_outputs(avatar, reference, safetensors.decode(file.read_bytes(), str(file)))
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=file) from None
    except AvatarError as error:
        raise AvatarError(error.message, file=error.file or file, field=error.field) from None


def _table(lines: list[Line]) -> Table:
    table = Table(*(Column(name, no_wrap=True) for name in COLUMNS), box=None, pad_edge=False)
    for line in lines:
        table.add_row(*line.cells, style=None if line.passed else "bold red")
    return table


def _save(folder: Path, drawn: dict[str, Pixels]) -> None:
    partial = folder.with_name(f".{folder.name}.{os.getpid()}.partial")
    try:
        partial.mkdir(parents=True)
        for name, pixels in drawn.items():
            (partial / name).write_bytes(png(pixels))
        partial.rename(folder)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=folder) from None
    finally:
        if partial.is_dir():
            shutil.rmtree(partial)
