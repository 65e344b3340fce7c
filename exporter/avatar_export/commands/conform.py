"""`avatar-export conform`: a bundle's own reference against a backend, or against the outputs of a port."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Column, Table

from avatar_export.checks.conform import Conformance, conform_bundle, save_images
from avatar_export.checks.conform_coverage import gap_lines
from avatar_export.checks.conform_report import (
    COLUMNS,
    Line,
    facts,
    failed_images,
    html_report,
    judged_lines,
    notes,
    stage_lines,
    verdict,
    worst_elements,
)
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages, output, print_json, tell
from avatar_export.readers.table import expect_bundle
from avatar_runtime.backends import BACKENDS
from avatar_runtime.io.errors import AvatarError, printable
from avatar_runtime.io.text_files import refuse_existing, write_text

FILE_WIDTH = 120  # characters per line where the output is not a terminal


def conform(
    bundle: arguments.Bundle,
    backend: arguments.Backend = None,
    outputs: Annotated[
        Path | None,
        typer.Option(
            help="FILE.safetensors with the outputs of a port, under the names in its reference's cases.json. They are "
            "compared in place of a backend."
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option(help="FILE.html to write, with tables and images.")] = None,
    images: Annotated[
        Path | None,
        typer.Option(
            "--pictures", help="Folder to write for images of failing cases: reference, drawn, difference."
        ),
    ] = None,
    force: arguments.Force = False,
    as_json: arguments.AsJson = False,
) -> None:
    """Compare a backend with the reference of a bundle or pack, stage by stage. The exit code is 1 if a stage fails."""
    arguments.one_of("--backend", backend, BACKENDS)
    arguments.exclude({"--outputs": outputs, "--backend": backend})
    if report is not None:
        refuse_existing(report, force)
    if images is not None and images.exists():
        raise AvatarError("exists; choose another name (folders are never replaced)", file=images)
    with Steps() as step:
        expect_bundle(bundle)
        found = conform_bundle(bundle, backend, outputs, step)
    if report is not None:
        write_text(report, html_report(found.title, found.report, found.reference, found.gaps), force=force)
        messages.print(f"{report}: tables and images")
    if images is not None:
        failed = failed_images(found.report)
        if failed:
            save_images(images, failed)
        messages.print(
            f"{images}: {len(failed)} images of failing cases" if failed else "no case fails: no images"
        )
    if as_json:
        print_json(facts(found.report, found.reference, found.gaps))
    else:
        _print(found)
    raise typer.Exit(0 if found.passed else 1)


def _print(found: Conformance) -> None:
    wide = output if output.is_terminal else Console(highlight=False, markup=False, width=FILE_WIDTH)
    lines = stage_lines(found.report, found.reference)
    wide.print(_table(lines))
    for text in worst_elements(lines):
        output.print(text, soft_wrap=True)
    output.print(f"{verdict(found.report)}; made by {found.reference.made_by}")
    if found.driving is not None:
        failed = [row for row in found.driving.rows if not row.passed]
        said = f"{failed[0].case}: {failed[0].stage} differs" if failed else "passes"
        output.print(f"driving: {len(found.driving.rows)} arrays, {said}")
    output.print(f"judged: {'; '.join(judged_lines(found.report))}")
    tell(notes(found.report, found.reference))
    for note in gap_lines(found.gaps) if found.passed else ():
        messages.print(f"note: {note}", soft_wrap=True)


def _table(lines: list[Line]) -> Table:
    table = Table(*(Column(name, no_wrap=True) for name in COLUMNS), box=None, pad_edge=False)
    for line in lines:
        table.add_row(*map(printable, line.cells), style=None if line.passed else "bold red")
    return table
