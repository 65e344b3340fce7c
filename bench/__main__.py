"""`make bench`: converts, loads and plays full-size avatars; prints the figures and appends them as CSV rows.

    python -m bench [--gaussians 70000] [--keep FOLDER]

The checkpoints (0.9 GB as a dump, 3.4 GB raw) are generated first; that time does not count. Besides the face's
Gaussians they hold a fifth as many for the teeth; the head on which backends are compared has `--gaussians` in all.
CPU time and peak resident memory are those of one fresh process a conversion.

    python -m bench --only backends

compares the backends alone, `--only lit` measures the light of a scene, `--only training` the differentiable renderer,
`--only posing` what a pose costs before anything is drawn, `--only unity` and `--only native` what it costs in C# and
C++, `--only packs` packs the head and plays the pack, `--only batch` converts many avatars on workers that are killed,
`--only distill` learns a head from frames, and `--only asm` poses faces of bones.
`python -m bench.compare` holds these rows against those of the last release. `python -m bench.packs` packs
every avatar to its budget; `python -m bench.gl_speed` gives frames per second on a GPU.
"""

from __future__ import annotations

import argparse
import csv
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from samples.make import make_splatting_head

from avatar_export import __version__
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from bench.asm_speed import asm_rows
from bench.backends import backend_rows, dense_rows, lit_rows, static_rows
from bench.batch.faults import fault_rows
from bench.batch.network import network_rows
from bench.batch.overhead import overhead_rows
from bench.batch.rows import row_rows
from bench.distill.large import large_rows
from bench.gl_speed import speed_rows
from bench.native_player import native_rows
from bench.packs import pack_rows
from bench.posing import posing_rows
from bench.training import training_rows
from bench.unity_player import unity_rows

RESULTS = Path(__file__).parent / "results"
FORMS = ("dump", "raw")
REPEATS = 5

Row = tuple[str, float, str]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gaussians", type=int, default=70_000)
    parser.add_argument("--keep", type=Path, help="make the checkpoints here, and use them if they are there")
    parser.add_argument("--only", choices=PARTS, help="measure this part alone")
    parser.add_argument("--no-save", action="store_true", help="append nothing to the results")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = args.keep or Path(scratch)
        rows = [
            row
            for name in ([args.only] if args.only else PARTS)
            for row in PARTS[name](folder, args.gaussians)
        ]
    for what, value, unit in rows:
        print(f"{what:36s} {value:12.4g} {unit}")
    if not args.no_save:
        print(save(rows, args.gaussians))


def conversion_rows(folder: Path, gaussians: int) -> list[Row]:
    """Converting and loading."""
    rows: list[Row] = []
    bundle = folder / "bundle_dump"
    for form in FORMS:
        base = folder / form / "gaussian_blendshapes"
        if not base.exists():
            make(folder / form, gaussians, form)
        size = sum(f.stat().st_size for f in (base / "model").rglob("*") if f.is_file())
        rows.append((f"checkpoint_{form}", size / 1e6, "MB"))
        inputs = ("--dataset", str(base), "--driving", str(base / "driving.json"))
        cpu, peak = converted((str(base / "model"), *inputs), folder / f"bundle_{form}")
        rows += [(f"convert_{form}_cpu", cpu, "s"), (f"convert_{form}_peak_rss", peak, "MB")]
    rows.append(("bundle", sum(f.stat().st_size for f in bundle.iterdir()) / 1e6, "MB"))
    load(bundle)
    wall, cpu = median_seconds(lambda: load(bundle))
    rows += [("load_warm_wall", wall, "s"), ("load_warm_cpu", cpu, "s")]
    return rows


def head(folder: Path, gaussians: int) -> Avatar:
    """The sample head with `gaussians` in all, teeth too, and 51 expressions."""
    base, out = folder / "head" / "gaussian_blendshapes", folder / "bundle_head"
    if not base.exists():
        make(folder / "head", round(gaussians / 1.2), "dump")
    converted((str(base / "model"), "--dataset", str(base), "--driving", str(base / "driving.json")), out)
    return load(out)


def compared_rows(folder: Path, gaussians: int) -> list[Row]:
    """One animated head on every backend, a still million on `cpu`, and the first frame of a new process."""
    avatar = head(folder, gaussians)
    rows = backend_rows(avatar) + dense_rows(avatar) + static_rows(avatar) + speed_rows(avatar)
    with tempfile.TemporaryDirectory() as cache:
        first = start(folder / "bundle_head", {"NUMBA_CACHE_DIR": cache})
    later = [start(folder / "bundle_head", {}) for _ in range(REPEATS)]
    return [*rows, ("cpu_first_start", first, "s"), ("cpu_second_start", statistics.median(later), "s")]


def start(bundle: Path, environment: dict[str, str]) -> float:
    """Seconds from a fresh process's `Player(avatar, "cpu")` to its first image."""
    program = (
        "import sys, time; from avatar_runtime.bundle import load; from avatar_runtime.player import Player\n"
        "from avatar_runtime.pose import Pose; from avatar_export.images import frame_camera, robust_box\n"
        "avatar = load(sys.argv[1]); camera = frame_camera(robust_box(avatar.gaussians.mean), 512, 512)\n"
        "start = time.perf_counter(); Player(avatar, 'cpu').frame(Pose(), camera); print(time.perf_counter() - start)"
    )
    command, variables = [sys.executable, "-c", program, str(bundle)], {**os.environ, **environment}
    done = subprocess.run(command, check=True, capture_output=True, env=variables)
    return float(done.stdout)


def batch_rows(folder: Path) -> list[Row]:
    """Faults on one machine and over a network, the cost against a shell loop, and rows alone."""
    return [
        *fault_rows(folder / "faults"),
        *network_rows(folder / "network"),
        *overhead_rows(folder / "overhead"),
        *row_rows(folder / "rows"),
    ]


def surface_rows(folder: Path, gaussians: int) -> list[Row]:
    """A SplattingAvatar head of as many Gaussians: converted, and posed frame by frame from its own clip."""
    base, out = folder / "surface" / "splatting_avatar" / "head", folder / "bundle_surface"
    if not base.exists():
        make_splatting_head(folder / "surface", gaussians)
    inputs = (
        "--body-model",
        str(base / "body" / "body_model.npz"),
        "--poses",
        str(base / "flame_params.json"),
    )
    cpu, peak = converted((str(base / "run"), *inputs), out)
    rows: list[Row] = [("convert_surface_cpu", cpu, "s"), ("convert_surface_peak_rss", peak, "MB")]
    avatar = load(out)
    for name, backend in (("surface", "reference"), ("surface_cpu", "cpu")):
        player, times = Player(avatar, backend), dict[str, list[float]]()
        player.animate(frame_pose(avatar, avatar.clips[0], 0))
        for frame in range(min(avatar.clips[0].frames, 3 * REPEATS)):
            milliseconds: dict[str, float] = {}
            player.animate(frame_pose(avatar, avatar.clips[0], frame), milliseconds)
            for stage, value in milliseconds.items():
                times.setdefault(stage, []).append(value)
        rows += [(f"{name}_{stage}", statistics.median(values), "ms") for stage, values in times.items()]
    return rows


def make(out: Path, gaussians: int, form: str) -> None:
    """Generate a checkpoint in a process of its own: a child's peak memory starts at its parent's."""
    flags = ("--system", "gaussian_blendshapes", "--gaussians", str(gaussians), "--form", form)
    subprocess.run(
        [sys.executable, "-m", "samples.make", str(out), *flags], check=True, stdout=subprocess.DEVNULL
    )


def converted(arguments: tuple[str, ...], out: Path) -> tuple[float, float]:
    """(CPU seconds, peak resident MB) of one `avatar-export convert` in its own process, files for engines too."""
    command = (
        *(sys.executable, "-m", "avatar_export", "convert", *arguments, "-o", str(out)),
        *("--force", "--no-preview"),
    )
    pid = subprocess.Popen(command).pid
    _, status, usage = os.wait4(pid, 0)
    if status:
        sys.exit(f"convert failed: {os.waitstatus_to_exitcode(status)}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024 / 1e6


def median_seconds(run: Callable[[], object]) -> tuple[float, float]:
    """Median (wall, CPU) seconds of REPEATS runs."""
    walls, cpus = [], []
    for _ in range(REPEATS):
        wall, cpu = time.perf_counter(), time.process_time()
        run()
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
    return statistics.median(walls), statistics.median(cpus)


def processor() -> str:
    """The processor's own name where the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def save(rows: list[Row], gaussians: int) -> Path:
    """Append the rows to results/MACHINE.csv."""
    RESULTS.mkdir(exist_ok=True)
    machine = re.sub(r"[^A-Za-z0-9]+", "-", f"{processor()} {os.cpu_count()} cores").strip("-")
    path = RESULTS / f"{machine}.csv"
    fresh = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if fresh:
            writer.writerow(["version", "face_gaussians", "what", "value", "unit"])
        for what, value, unit in rows:
            writer.writerow([__version__, gaussians, what, f"{value:.4g}", unit])
    return path


PARTS: dict[str, Callable[[Path, int], list[Row]]] = {
    "conversion": conversion_rows,
    "surface": surface_rows,
    "backends": compared_rows,
    "lit": lambda folder, gaussians: lit_rows(),
    "training": training_rows,
    "posing": lambda folder, gaussians: posing_rows(),
    "unity": lambda folder, gaussians: unity_rows(),
    "native": lambda folder, gaussians: native_rows(),
    "packs": lambda folder, gaussians: pack_rows(head(folder, gaussians)),
    "batch": lambda folder, gaussians: batch_rows(folder / "batch"),
    "distill": lambda folder, gaussians: large_rows(),
    "asm": lambda folder, gaussians: [*asm_rows()],
}

if __name__ == "__main__":
    main()
