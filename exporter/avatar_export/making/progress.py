"""How far a folder of `make` has come: make.json names the film, the options, and the steps that have ended.

It is written before the first step and after each one, whole or not at all, so that a process that was killed at any
moment is continued. A step that did not end is run again; the programs continue or replace what it left.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from avatar_export.making.options import Film, Wanted
from avatar_export.making.steps import WORDS, Plan, Step
from avatar_export.version import GENERATOR
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.io.staging import remove
from avatar_runtime.io.text_files import write_text
from avatar_runtime.io.whole_files import read_bytes

FILE = "make.json"
FORMAT = "avatar-export-make"
MOST = 1 << 20  # bytes of FILE
PATIENCE = 20.0  # seconds for the step of a process that was killed to end
FILM = "film"  # in place of the flag of an option that differs
GOING = ".going"  # what is being removed


@dataclass
class Progress:
    """What make.json says, and the folder that it is in."""

    plan: Plan
    film: Mapping[str, Any]  # the file's name, size and hash
    done: list[str]  # names of steps that have ended

    def write(self) -> None:
        """Writes make.json."""
        document = {"format": FORMAT, "generator": GENERATOR} | {
            "film": self.film,
            "options": self.plan.options(),
            "done": self.done,
        }
        text = json.dumps(document, indent=1, ensure_ascii=False)
        write_text(self.plan.out / FILE, f"{text}\n", force=True)

    def has(self, step: Step) -> bool:
        """Whether the step has ended, and what it wrote is there."""
        return step.name in self.done and (self.plan.out / step.name).exists()

    def forget(self, steps: Sequence[Step], *, removed: Sequence[str] = ()) -> None:
        """These steps have not ended; what those called `removed` wrote goes."""
        out, names = self.plan.out, {step.name for step in steps}
        if names & {*self.done}:
            self.done = [name for name in self.done if name not in names]
            self.write()
        for name in removed:
            with suppress(FileNotFoundError):
                (out / name).rename(out / GOING)  # a process that is killed here leaves no half of it
            remove(out / GOING)

    def end(self, step: Step) -> None:
        """Remembers it."""
        self.done.append(step.name)
        self.write()

    def leave(self) -> None:
        """Takes the folder away if no step has left anything in it."""
        if [path.name for path in self.plan.out.iterdir()] == [FILE]:
            (self.plan.out / FILE).unlink()
            with suppress(OSError):
                self.plan.out.rmdir()


def open_progress(given: Plan, force: bool) -> Progress:
    """How far the folder of a plan has come, in which make.json is written. An option that is left out is as before.
    What was made of another film, or by other options, is forgotten with `force`, and if no step has ended; words of
    consent and licence are put in where there were none.

    Raises AvatarError for such a folder otherwise, and for one that `make` did not write.
    """
    out, film = given.out, _film(given.video)
    held = _read(out, given)
    remove(out / GOING)
    if held is None:
        progress = Progress(given.filled({}), film, [])
    else:
        before = held.plan.options()
        differs = [flag for flag, value in given.options().items() if value not in (None, before[flag])]
        if held.film["sha256"] != film["sha256"]:
            differs.insert(0, FILM)
        if not force and held.done and not all(flag in WORDS and before[flag] is None for flag in differs):
            raise AvatarError(_difference(differs, held), file=out)
        plan = given.filled(before)
        steps = plan.steps()
        concerned = [FILM in differs or bool({*step.made_of} & {*differs}) for step in steps]
        if any(concerned):
            again = steps[concerned.index(True) :]
            held.forget(again, removed=[step.name for step in again if step.name in ("capture", "run")])
        if {*WORDS} & {*differs}:
            held.forget(steps[:1])  # it goes on, and writes the words; what was trained stays
        progress = Progress(plan, film, held.done)
    progress.write()
    return progress


def _difference(differs: Sequence[str], before: Progress) -> str:
    first, others = differs[0], differs[1:]
    if first == FILM:
        name = str(before.film.get("name"))[:80]
        return f"was made of another film ({name}); name another folder, or pass --force to begin again"
    was = before.plan.options()[first]
    return (
        f"was made {f'without {first}' if was is None else f'with {first} {str(was)[:80]}'}"
        f"{' and with another ' * bool(others)}{', '.join(others[:4])}; pass the same, name another folder, or pass "
        "--force to make again what depends on it"
    )


@contextmanager
def alone(out: Path) -> Iterator[int | None]:
    """The folder `out`, made if need be, for this process and the steps that inherit the descriptor.

    Raises AvatarError while another process has it. On Windows, which has no such lock, nobody is kept out.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=out) from None
    try:
        import fcntl
    except ImportError:
        yield None
        return
    descriptor = os.open(out, os.O_RDONLY)
    try:
        until = time.monotonic() + PATIENCE
        while True:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > until:
                    raise AvatarError(
                        "another `make` works in it; wait until it has ended", file=out
                    ) from None
                time.sleep(0.1)
        yield descriptor
    finally:
        os.close(descriptor)


def _film(video: Path) -> Mapping[str, Any]:
    """Name, size and hash. Raises AvatarError for a file that cannot be read."""
    try:
        with open_file(video) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            return {"name": video.name, "bytes": file.tell(), "sha256": digest}
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=video) from None


def _read(out: Path, given: Plan) -> Progress | None:
    """What make.json says, with its options in the place of those given; None for an empty folder.

    Raises AvatarError for a folder of something else."""
    file = out / FILE
    if not file.exists():
        if out.is_dir() and any(out.iterdir()):
            raise AvatarError("exists and was not made by `make`; name another folder", file=out)
        return None
    try:
        held = json.loads(read_bytes(file, MOST))
        film, options, done = held["film"], held["options"], held["done"]
        plan = replace(given, film=Film(), wanted=Wanted()).filled(options)
        sound = held["format"] == FORMAT and isinstance(film["sha256"], str) and {*map(type, done)} <= {str}
    except (ValueError, RecursionError, LookupError, TypeError, AttributeError):
        sound = False
    if not sound:
        raise AvatarError("is not the make.json of `make`; move the folder away", file=file)
    return Progress(plan, film, done)
