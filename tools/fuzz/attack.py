"""One hostile input after the other, in this process. A target, a seed and a number always give the same input."""

from __future__ import annotations

import hashlib
import os
import resource
import shutil
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from random import Random

from avatar_runtime.io.errors import AvatarError
from tools.fuzz.mutate import mutated
from tools.fuzz.pack_mutants import mutant
from tools.fuzz.targets import TARGETS, Target, attacked, sound

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / "tests" / "data" / "fuzz"  # a finding: TARGET/INPUT-HASH/ with the files that are not sound
SECONDS = 10.0  # of CPU for one input; what takes longer hangs
MEMORY = 512 << 20  # bytes by which one input may raise the most that the process ever held
LONGEST = 3000  # letters of an AvatarError
SOUND, REFUSED, CRASH, HANG, GREEDY = "sound", "refused", "crash", "hang", "memory"


class Hang(BaseException):
    """An input takes too long."""


@dataclass(frozen=True)
class Outcome:
    """What became of one input."""

    kind: str
    text: str = ""  # of a finding


class Arena:
    """The sound inputs of a target in one folder, and copies of them to change."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.target = name, TARGETS[name]
        self.good, self.scratch = folder / "good", folder / "scratch"
        if not self.good.is_dir():
            partial = folder / f"made.{os.getpid()}"
            partial.mkdir(parents=True)
            self.target.make(partial)
            partial.rename(self.good)

    @cached_property
    def inputs(self) -> dict[str, dict[Path, bytes]]:
        """Input -> the files of it that are changed."""
        return {
            folder.name: {path: (folder / path).read_bytes() for path in attacked(self.target, folder)}
            for folder in sorted(self.good.iterdir())
        }

    def lay(self, name: str, changed: dict[Path, bytes], rng: Random) -> Path:
        """The folder of a copy in which these files are `changed`."""
        folder = self.scratch / name
        if not folder.is_dir():
            shutil.copytree(self.good / name, folder)
        for path, data in changed.items():
            (folder / path).write_bytes(data)
        self.target.finish(folder, rng)
        return folder

    def restore(self, name: str, changed: Iterable[Path]) -> None:
        """The copy, of which `changed` files were laid, is sound again."""
        for path in {*changed, *map(Path, self.target.finished)}:
            (self.scratch / name / path).write_bytes(self.inputs[name][path])

    def differing(self, name: str) -> dict[Path, bytes]:
        """The files of the copy that differ from the sound input."""
        folder = self.scratch / name
        return {
            path: held
            for path, data in self.inputs[name].items()
            if (held := (folder / path).read_bytes()) != data
        }


def hostile(arena: Arena, rng: Random) -> tuple[str, dict[Path, bytes]]:
    """(input, its changed files) as the generator draws them."""
    name = rng.choice(list(arena.inputs))
    files = arena.inputs[name]
    chosen = rng.sample(list(files), min(len(files), rng.choice((1, 1, 1, 2))))
    return name, {
        path: mutant(files[path], rng) if path.suffix == ".avatar" else mutated(path.name, files[path], rng)
        for path in chosen
    }


def attack(arena: Arena, seed: int, number: int, corpus: Path | None = CORPUS) -> Outcome:
    """Reads the input of this number; a finding is kept in `corpus`."""
    rng = Random(f"{arena.name}/{seed}/{number}")
    name, changed = hostile(arena, rng)
    folder = arena.lay(name, changed, rng)
    outcome = judged(arena.target, folder)
    if outcome.text and corpus is not None:
        keep(corpus / arena.name, name, arena.differing(name), outcome)
    arena.restore(name, changed)
    return outcome


def judged(target: Target, folder: Path) -> Outcome:
    """What `target` makes of a folder."""
    before = most_memory()
    try:
        with limited(SECONDS):
            sound(target.read(folder))
        outcome = Outcome(SOUND)
    except AvatarError as error:
        line = str(error)
        fair = line.isprintable() and len(line) <= LONGEST
        outcome = Outcome(REFUSED) if fair else Outcome(CRASH, f"not one short printable line: {line!r}")
    except Hang:
        outcome = Outcome(HANG, traceback.format_exc(limit=-5))
    except Exception:  # any other one is a bug, whatever it is
        outcome = Outcome(CRASH, traceback.format_exc(limit=-8))
    if most_memory() - before > MEMORY and not outcome.text:
        return Outcome(GREEDY, f"{(most_memory() - before) >> 20} MiB more than any input before it")
    return outcome


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raises Hang in the block after some CPU seconds, on a busy machine too. What sleeps is killed by `run`."""

    def stop(*_: object) -> None:
        raise Hang

    handler: Callable[..., object] | int | None = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, handler)


def most_memory() -> int:
    """Bytes of the most that this process ever held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def keep(folder: Path, name: str, files: dict[Path, bytes], outcome: Outcome) -> None:
    """Writes a finding. One place in the code gives one finding, however many inputs lead there."""
    key = hashlib.sha256("\n".join(outcome.text.splitlines()[-4:]).encode()).hexdigest()[:10]
    place = folder / f"{name}-{key}"
    if place.exists():
        return
    for path, data in files.items():
        (place / path).parent.mkdir(parents=True, exist_ok=True)
        (place / path).write_bytes(data)
    place.mkdir(parents=True, exist_ok=True)
    text = outcome.text.replace(f"{ROOT}{os.sep}", "")
    (place / "finding.text").write_text(f"{outcome.kind}\n{text}\n")
