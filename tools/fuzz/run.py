"""Hostile inputs in large numbers, in worker processes: what kills or blocks a worker is a finding, too."""

from __future__ import annotations

import mmap
import os
import resource
import shutil
import signal
import struct
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path

from tools.fuzz.attack import (
    CORPUS,
    CRASH,
    GREEDY,
    HANG,
    REFUSED,
    SECONDS,
    SOUND,
    Arena,
    Outcome,
    attack,
    keep,
    most_memory,
)

CHUNK = 500  # inputs of one target that a worker gets at once
ADDRESS_SPACE = 6 << 30  # bytes a worker may map
STUCK = 3 * SECONDS  # after which a worker that no signal reaches is killed
KINDS = (SOUND, REFUSED, CRASH, HANG, GREEDY)
STATE = struct.Struct("=Qdd6Q")  # number, when it began, CPU seconds, one counter a kind, most memory


@dataclass
class Tally:
    """What became of the inputs of one target."""

    sound: int = 0
    refused: int = 0
    crashes: int = 0
    hangs: int = 0
    greedy: int = 0
    most_memory: int = 0  # bytes that one worker held
    cpu_seconds: float = 0.0

    @property
    def inputs(self) -> int:
        """All of them."""
        return self.sound + self.refused + self.findings

    @property
    def findings(self) -> int:
        """Those that neither gave a sound result nor one line."""
        return self.crashes + self.hangs + self.greedy

    def add(self, other: Tally) -> None:
        """Adds the counts of `other`."""
        for one in fields(self):
            mine, theirs = getattr(self, one.name), getattr(other, one.name)
            setattr(self, one.name, max(mine, theirs) if one.name == "most_memory" else mine + theirs)


@dataclass
class Worker:
    """A process and what it says of itself in memory that both share."""

    process: int
    target: str
    last: int  # the number after that of its last input
    state: mmap.mmap
    tally: Tally = field(default_factory=Tally)

    def read(self) -> tuple[int, float, Tally]:
        """(number of the present input, when it began, counts)."""
        number, began, cpu, *counts = STATE.unpack_from(self.state)
        return number, began, Tally(*counts, cpu)


def run(
    counts: Mapping[str, int], folder: Path, *, seed: int = 0, first: int = 0, workers: int = 2,
    seconds: float | None = None, corpus: Path = CORPUS,
) -> dict[str, Tally]:  # fmt: skip
    """Reads that many inputs of each target, `first` and those after it, for at most `seconds` in all.

    Targets take turns, so that a run that is cut short has attacked them all. Findings are kept in `corpus`.
    """
    found = {name: Tally() for name in counts}
    arenas = {name: Arena(name, folder / name) for name in counts}  # in this process, once
    for arena in arenas.values():
        _ = arena.inputs
    chunks, busy = _chunks(counts, first), list[Worker]()
    ends = None if seconds is None else time.monotonic() + seconds
    waiting = next(chunks, None)
    while busy or waiting:
        while waiting and len(busy) < workers:
            busy.append(_start(arenas[waiting[0]], seed, *waiting[1:], corpus))
            waiting = next(chunks, None)
            if ends is not None and time.monotonic() > ends:
                waiting = None
        for worker in [w for w in busy if _ended(w, arenas[w.target], corpus)]:
            busy.remove(worker)
            found[worker.target].add(worker.tally)
            number = worker.read()[0] + 1
            if number < worker.last:  # it died; another goes on behind what killed it
                busy.append(_start(arenas[worker.target], seed, number, worker.last, corpus))
        time.sleep(0.02)
    return found


def _chunks(counts: Mapping[str, int], first: int) -> Iterator[tuple[str, int, int]]:
    """(target, first number, the one after the last)."""
    at = dict.fromkeys(counts, 0)
    while any(at[name] < count for name, count in counts.items()):
        for name, count in counts.items():
            size = min(CHUNK, count - at[name])
            if size > 0:
                yield name, first + at[name], first + at[name] + size
                at[name] += size


def _start(arena: Arena, seed: int, first: int, last: int, corpus: Path) -> Worker:
    state = mmap.mmap(-1, STATE.size)
    STATE.pack_into(state, 0, first, time.monotonic(), 0.0, *[0] * 6)
    process = os.fork()
    if process:
        return Worker(process, arena.name, last, state)
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE,) * 2)
        arena.scratch = arena.scratch.with_name(f"scratch.{os.getpid()}")
        _work(arena, seed, first, last, state, corpus)
        code = 0
    finally:
        os._exit(code)


def _work(arena: Arena, seed: int, first: int, last: int, state: mmap.mmap, corpus: Path) -> None:
    counts = dict.fromkeys(KINDS, 0)
    for number in range(first, last):
        STATE.pack_into(
            state, 0, number, time.monotonic(), time.process_time(), *counts.values(), most_memory()
        )
        counts[attack(arena, seed, number, corpus).kind] += 1
    STATE.pack_into(state, 0, last, 0.0, time.process_time(), *counts.values(), most_memory())


def _ended(worker: Worker, arena: Arena, corpus: Path) -> bool:
    """Whether a worker has ended; one that is stuck is killed. What ended it early is kept as a finding."""
    ended, status = os.waitpid(worker.process, os.WNOHANG)
    number, began, worker.tally = worker.read()
    if not ended:
        if began and time.monotonic() - began > STUCK:
            os.kill(worker.process, signal.SIGKILL)
        return False
    folder = arena.scratch.with_name(f"scratch.{worker.process}")
    if number < worker.last:
        code = os.waitstatus_to_exitcode(status)
        killed = code == -signal.SIGKILL
        outcome = Outcome(HANG if killed else CRASH, f"input {number}: the process ended with {code}")
        worker.tally.hangs += killed
        worker.tally.crashes += not killed
        scratch, arena.scratch = arena.scratch, folder
        for name in [path.name for path in folder.iterdir()] if folder.is_dir() else []:
            differing = arena.differing(name)
            if differing:
                keep(corpus / arena.name, name, differing, outcome)
        arena.scratch = scratch
    shutil.rmtree(folder, ignore_errors=True)
    return True
