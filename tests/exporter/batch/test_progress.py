"""What a batch prints where there is no terminal."""

from __future__ import annotations

import io

from avatar_export.batch.result import Result
from avatar_export.commands.batch import BatchProgress
from avatar_export.commands.console import CleanConsole


def test_without_a_terminal_each_row_is_a_line() -> None:
    written = io.StringIO()
    console = CleanConsole(file=written, force_terminal=False, width=80, soft_wrap=True)
    with BatchProgress(2, console) as progress:
        progress.started("anna", "0")
        progress.ended(Result("anna", "done", seconds=1.25))
        progress.ended(Result("ben\x1b[2J", "failed", "input", "is wrong", "mend it"))
    assert written.getvalue() == "1/2 anna: done, 1.2 s\nben?[2J: failed: is wrong; mend it\n"
