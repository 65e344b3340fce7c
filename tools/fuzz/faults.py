"""Commands under bad conditions: killed, interrupted, without disk, streams or memory; and a table of how they end.

`python -m tools.fuzz.faults` runs each command under each kind of fault. A command may fail, but only with one of its
exit codes, without a traceback, and with an output that is whole or absent. What a kill leaves, the next run mends.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from samples.make import make_lam
from tests import bundles
from tests.exporter.drop.projects import UNITY, contents, lay
from tests.exporter.serving.packs import packed

ROOT = Path(__file__).parents[2]
LIMIT = 180.0  # seconds of one run
CODES = {0, 2, 3, 129, 130, 141, 143}  # and 1 where a command may find errors
UNCATCHABLE = -signal.SIGKILL


@dataclass(frozen=True)
class Command:
    """One command line, and what its output must be."""

    words: Callable[[Path, Path], list[str]]  # of (folder of inputs, output)
    whole: Callable[[Path], bool]  # of an output that exists
    found: bool = False  # whether exit code 1 says that something was found
    out: str = "out"


@dataclass(frozen=True)
class Fault:
    """One bad condition; drawn from a generator, since a kill comes at any time."""

    name: str
    shell: str = ""  # a redirection
    limits: Mapping[int, int] = field(default_factory=dict)  # resource -> bytes
    number: int = 0  # of a signal
    after: float = 0.0  # share of the time that the command takes undisturbed


@dataclass(frozen=True)
class End:
    """How a run ended."""

    code: int
    error: str
    wrong: str = ""  # what may not be


def kill(rng: Random) -> Fault:
    """A signal at any time."""
    name = rng.choice(["SIGKILL", "SIGKILL", "SIGTERM", "SIGINT", "SIGHUP"])
    return Fault(name, number=getattr(signal, name), after=rng.random())


def full_disk(rng: Random) -> Fault:
    """No file may become longer than a few bytes: writes fail as on a full disk, with another error number."""
    return Fault(
        "no room", limits={resource.RLIMIT_FSIZE: rng.choice((0, 100, 5000, 60_000, rng.randrange(1 << 20)))}
    )


def closed_stream(rng: Random) -> Fault:
    """Standard streams that are closed, full, or that nobody reads."""
    shell = rng.choice(
        [">&-", "2>&-", "<&-", "<&- >&- 2>&-", ">/dev/full", "2>/dev/full", "| true", "2>&1 | true"]
    )
    return Fault(f"streams {shell}", shell=shell)


def little_memory(rng: Random) -> Fault:
    """A limit of the address space."""
    size = rng.randrange(40, 2000) << 20
    return Fault(f"{size >> 20} MiB", limits={resource.RLIMIT_AS: size})


KINDS: dict[str, Callable[[Random], Fault]] = {
    "kills and interrupts": kill,
    "full disk": full_disk,
    "streams": closed_stream,
    "little memory": little_memory,
}


def _bundle(out: Path) -> bool:
    from avatar_runtime.bundle import load

    load(out)
    return True


def _image(out: Path) -> bool:
    from PIL import Image

    Image.open(out).load()
    return True


def _trained(out: Path) -> bool:
    from avatar_trainer.loop import checkpoint

    said: list[str] = []
    checkpoint.newest(out / "checkpoints", said.append)
    return not said


def _game(out: Path) -> Path:
    """A project of Unity at `out`; what an earlier run put there is away, so that there is something to do."""
    subprocess.run(["rm", "-rf", out / "Packages", out / "Assets"], check=True)
    return lay(out, UNITY)


def _dropped(out: Path) -> bool:
    from avatar_export.players.assemble import assemble
    from avatar_runtime.packs import read_pack

    own = {f"Packages/com.avatar-export.player/{path}": data for path, data in assemble("unity").items()}
    player = {
        path: data for path, data in contents(out).items() if path.startswith(("Packages/com", "Packages/."))
    }
    for pack in out.rglob("Assets/**/*.avatar"):
        read_pack(pack)
    return player in ({}, own)


TOY = ("--iterations", "30", "--checkpoint-every", "5")
COMMANDS: dict[str, Command] = {
    "convert": Command(
        lambda at, out: ["avatar_export", "convert", str(at / "lam" / "head.zip"), "-o", str(out), "--force"],
        _bundle,
    ),
    "render": Command(
        lambda at, out: [
            "avatar_export",
            "render",
            str(at / "bundle"),
            "-o",
            str(out),
            "--size",
            "48",
            "--force",
        ],
        _image,
        out="out.png",
    ),
    "drop": Command(
        lambda at, out: ["avatar_export", "drop", str(at / "pack.avatar"), "--into", str(_game(out))],
        _dropped,
    ),
    "train": Command(
        lambda at, out: ["tests.trainer.train_toy", "toy", str(at / "toy"), "-o", str(out), *TOY],
        _trained,
    ),
    "validate": Command(
        lambda at, _: ["avatar_export", "validate", str(at / "bundle")], lambda _: True, found=True
    ),
}


def inputs(folder: Path) -> Path:
    """Writes what the commands read."""
    from tests.trainer.toy import capture_folder

    make_lam(folder)
    bundles.write(folder / "bundle")
    capture_folder(folder / "toy")
    (folder / "pack.avatar").write_bytes(packed())
    return folder


def run(command: Command, fault: Fault, at: Path, out: Path, takes: float) -> End:
    """Runs a command once; `takes`: its seconds undisturbed."""
    words = [sys.executable, "-m", *command.words(at, out)]
    code_file = out.parent / "code"
    shell = (
        f'exec "$@" {fault.shell}' if "|" not in fault.shell else f'("$@"; echo $? > "$CODE") {fault.shell}'
    )
    code_file.unlink(missing_ok=True)
    before = {path.name for path in out.parent.iterdir()}  # also what an earlier kill has left

    def limit() -> None:
        for what, size in fault.limits.items():
            resource.setrlimit(what, (size, size))

    process = subprocess.Popen(
        ["bash", "-c", shell, "bash", *words],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace", cwd=ROOT,
        preexec_fn=limit, env=os.environ | {"CODE": str(code_file)},
    )  # fmt: skip
    if fault.number:
        time.sleep(fault.after * takes)
        process.send_signal(fault.number)
    try:
        _, error = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        return End(0, process.communicate()[1], "hangs")
    code = int(code_file.read_text()) if code_file.exists() else process.returncode
    code = code if code < 128 or code in CODES else 128 - code  # of a shell
    return End(code, error, _wrong(command, fault, code, error, out, before))


def _wrong(command: Command, fault: Fault, code: int, error: str, out: Path, before: set[str]) -> str:
    allowed = CODES | ({1} if command.found else set()) | ({-fault.number} if fault.number else set())
    if code not in allowed:
        return f"ended with {code}"
    if "Traceback" in error or "Exception ignored" in error:
        return "a traceback"
    if code == 2 and fault.limits.get(resource.RLIMIT_AS):
        return "too little memory is called bad data"
    if out.exists():
        try:
            if not command.whole(out):
                return "the output is not whole"
        except Exception as problem:  # whatever reads it
            return f"the output is not whole: {problem}"
    beside = {path.name for path in out.parent.iterdir()} - {out.name, "code"} - before
    if beside and code != UNCATCHABLE:
        return f"left behind: {sorted(beside)}"
    return ""


def attack(name: str, kind: str, each: int, at: Path, folder: Path, seed: int = 0) -> list[tuple[Fault, End]]:
    """Runs a command under `each` faults of one kind, and once undisturbed at the end, which must work."""
    command, rng = COMMANDS[name], Random(f"{name}/{kind}/{seed}")
    folder.mkdir(parents=True)
    out = folder / command.out
    began = time.monotonic()
    first = run(command, Fault("none"), at, out, 0)
    takes, ends = time.monotonic() - began, [(Fault("none"), first)]
    for number in range(each):
        if name == "train" and number % 3 == 0:
            subprocess.run(["rm", "-rf", str(out)], check=True)
        fault = KINDS[kind](rng)
        ends.append((fault, run(command, fault, at, out, takes)))
    last = run(command, Fault("none, last"), at, out, 0)
    if last.code or list(folder.glob(".*")):
        last = End(last.code, last.error, last.wrong or "a later run does not mend what was left")
    return [*ends, (Fault("none, last"), last)]


def main() -> None:
    """Print the figures; the exit code is 1 after a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=100, help="runs of a command, over all kinds of faults")
    parser.add_argument("--command", choices=COMMANDS, action="append")
    parser.add_argument("--kind", choices=KINDS, action="append")
    given = parser.parse_args()
    wrong: list[str] = []
    kinds = given.kind or list(KINDS)
    print("| command | faults | runs | exit codes | wrong |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="avatar-faults-") as work:
        at = inputs(Path(work) / "inputs")
        for name in given.command or COMMANDS:
            for kind in kinds:
                each = -(-given.each // len(kinds))
                ends = attack(name, kind, each, at, Path(work) / f"{name} {kind}")
                bad = [(fault, end) for fault, end in ends if end.wrong]
                codes = ", ".join(
                    f"{code}: {n}" for code, n in sorted(Counter(e.code for _, e in ends).items())
                )
                print(f"| {name} | {kind} | {len(ends)} | {codes} | {len(bad)} |", flush=True)
                wrong += [f"{name}, {fault}: {end.wrong}\n{end.error[-1500:]}" for fault, end in bad]
    print("\n".join(wrong))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
