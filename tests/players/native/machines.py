"""The machines that run the native core in the tests: this one, Windows by Wine, and ARM of 64 bits by QEMU.

Fixture `machine` runs a test on each of them. ARM multiplies and adds in one step where the compiler is let: each build
of MACHINES["arm ..."] has another answer to that, and one flushes small numbers to zero, as some engines do.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass

import pytest
from tools.windows import wine

from tests.session.native import SANITIZED
from tests.session.needed import need

# Undefined behaviour ends the program: addresses that are not aligned, too.
TRAPS = ("-O2", "-fsanitize=undefined", "-fsanitize-trap=undefined")
WINDOWS, ARM = "x86_64-windows-gnu", "aarch64-linux-musl"


@dataclass(frozen=True)
class Machine:
    """What compiles for a machine, and what runs its programs."""

    flags: tuple[str, ...]
    target: str = ""  # as Zig names it; this machine, if empty
    emulator: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()  # of players/native/tests, beside those of the probe

    @property
    def on_windows(self) -> bool:
        return self.target == WINDOWS

    def need(self) -> None:
        """Skips the test where the machine cannot be had."""
        need({f"{tool} (qemu-user)": shutil.which(tool) for tool in self.emulator})
        if self.on_windows:
            try:
                wine.prefix()
            except wine.Missing as error:
                need({f"Wine ({error})": None})


def _arm(*flags: str, sources: tuple[str, ...] = ()) -> Machine:
    return Machine((*TRAPS, *flags), ARM, ("qemu-aarch64",), sources)


HERE = Machine(SANITIZED)
MACHINES = {
    "here": HERE,
    "windows": Machine(TRAPS, WINDOWS),
    "arm": _arm("-ffp-contract=off"),  # as CMakeLists.txt asks for
    "arm, contract on": _arm("-ffp-contract=on"),  # clang's default
    "arm, contract fast": _arm("-ffp-contract=fast"),  # g++'s default
    "arm, flush to zero": _arm("-ffp-contract=off", sources=("flush",)),
}
MARKS = {"windows": (pytest.mark.players,), "arm": (pytest.mark.more,)}


def elsewhere() -> list[str]:
    """The names of the others."""
    return [name for name in MACHINES if name != "here"]


def parameters(names: list[str]) -> list[object]:
    """Parameters of a fixture or a test: Windows in `make players`, ARM in `make test-more`."""
    return [pytest.param(name, marks=MARKS.get(name.partition(",")[0], ())) for name in names]
