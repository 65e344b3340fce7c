"""The machines that run the native core in the tests: this one, Windows by Wine, and ARM of 64 bits by QEMU.

Fixture `machine` runs a test on each of them. ARM multiplies and adds in one step where the compiler may contract them.
One build lets it, one does not, and one flushes small numbers to zero, as some engines do.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass

import pytest
from _pytest.mark.structures import ParameterSet
from tools.windows import wine

from tests.session.native import SANITIZED
from tests.session.needed import need

# Undefined behaviour ends the program: addresses that are not aligned, too.
TRAPS = ("-O2", "-fsanitize=undefined", "-fsanitize-trap=undefined")
WINDOWS, ARM = "x86_64-windows-gnu", "aarch64-linux-musl"


@dataclass(frozen=True)
class Machine:
    """What compiles for a machine, and what runs its programs."""

    name: str
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


def _arm(name: str, *flags: str, sources: tuple[str, ...] = ()) -> Machine:
    return Machine(f"arm, {name}", (*TRAPS, *flags), ARM, ("qemu-aarch64",), sources)


HERE = Machine("here", SANITIZED)
ELSEWHERE = (
    Machine("windows", TRAPS, WINDOWS),
    _arm("contract off", "-ffp-contract=off"),  # as CMakeLists.txt asks for
    _arm("contract on", "-ffp-contract=on"),  # the default of clang
    _arm("flush to zero", "-ffp-contract=off", sources=("flush",)),
)
MARKS = {"windows": pytest.mark.players, "arm": pytest.mark.more}


def parameters(*machines: Machine) -> list[ParameterSet]:
    """Parameters of a fixture or a test: Windows in `make players`, ARM in `make test-more`."""
    return [
        pytest.param(one, id=one.name, marks=MARKS[one.name.partition(",")[0]] if one.target else ())
        for one in machines
    ]
