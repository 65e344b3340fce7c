"""`avatar-export view`: avatars in a browser, from this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages
from avatar_export.live.ports import LIVE_LINK_PORT, OSC_PORT, Ports
from avatar_export.serving.sources import sources_of
from avatar_runtime.io.errors import printable
from avatar_runtime.io.text_files import refuse_existing

Sources = Annotated[
    list[Path],
    typer.Argument(
        help="Packs, bundles, or outputs of training (see `systems`); what is no pack is packed. An avatar that needs "
        "further inputs: `pack` it first."
    ),
]


def view(
    sources: Sources,
    port: Annotated[int, typer.Option(help="Port of the page. 0: a free one.", min=0, max=65535)] = 0,
    lan: Annotated[
        bool,
        typer.Option("--lan", help="Serve the local network, too, for a phone. It gets WebGL2, not WebGPU."),
    ] = False,
    no_open: Annotated[bool, typer.Option("--no-open", help="Open no browser; print the address.")] = False,
    live: Annotated[
        bool,
        typer.Option(
            "--live", help="Receive motion: Live Link Face and VMC by UDP, and JSON over a WebSocket."
        ),
    ] = False,
    live_port: Annotated[
        int, typer.Option(help="UDP port for Live Link Face.", min=0, max=65535)
    ] = LIVE_LINK_PORT,
    osc_port: Annotated[int, typer.Option(help="UDP port for VMC over OSC.", min=0, max=65535)] = OSC_PORT,
    record: Annotated[
        Path | None,
        typer.Option(help="FILE.csv to write: what arrives, as a recording of Live Link Face. Needs --live."),
    ] = None,
    force: arguments.Force = False,
) -> None:
    """Show avatars in the browser, and again whenever their files change. Ctrl+C ends it.

    The first line of the output is the address. It holds a random token, and only this machine can open it.
    """
    from avatar_export.live.receiver import Receiver  # with asyncio and websockets, as the next line
    from avatar_export.serving import run

    if record is not None and not live:
        raise typer.BadParameter("there is nothing to record without --live", param_hint="--record")
    if record is not None:
        refuse_existing(record, force)
    receiver = Receiver(Ports(live_port, osc_port), messages.print, record) if live else None
    try:
        voice = run.Voice(_print_now, messages.print, Steps)
        run.view(sources_of(sources), run.Choices(port, lan, not no_open), voice, receiver)
    finally:
        if receiver is not None:
            receiver.close()


def _print_now(line: str) -> None:
    print(printable(line), flush=True)
