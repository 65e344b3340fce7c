"""Prints what is reached: `python -m bench.distill [ROW ...]`.

Truth is the dump drawn by backend `cpu` from three cameras in turn (front, 40 degrees to each side), 256x256.
Foreground is alpha above 0.5 in the truth; takes are held out whole.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from samples.dumps import clip_poses, random_poses, write_dumps
from tests.shared_data import ROOT

from avatar_export.distill import make
from avatar_export.readers.table import read
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.pose import Pose
from bench.distill import boxes
from bench.distill.large import large
from bench.distill.untaught import untaught

NORMATIVE = ("gaussians.ply", "blendshapes.safetensors", "embedding.safetensors", "rig.safetensors")


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    name: str
    make: boxes.Make
    takes: boxes.Takes
    with_rig: bool = False
    network: bool = False


def rows() -> list[Row]:
    """The table, without the rows `lam` and `large`."""
    head, splat, body = boxes.head_blendshapes(), boxes.head_splatting(), boxes.body_splatting()
    clip = clip_poses(splat, "training")
    neural = boxes.clip_only(head, 216, 72) | boxes.randoms(head, 216, 48, 8.0)
    return [
        Row("blendshapes_clip", lambda: head, boxes.clip_only(head, 96, 24)),
        Row("blendshapes_random", lambda: head, boxes.randoms(head, 96, 24, 8.0)),
        Row("splatting_clip", lambda: splat, boxes.clip_only(splat, 144, 56), True),
        Row(
            "splatting_random", lambda: splat,
            {"clip": boxes.spread(clip, 96)} | boxes.randoms(splat, 60, 24, 8.0), True,
        ),
        Row("body", lambda: body, _body(body), True),
        Row("neural", lambda: head, neural, network=True),
    ]  # fmt: skip


def _body(body: Avatar) -> boxes.Takes:
    return {"walk": clip_poses(body, "walk")[:48]} | boxes.randoms(body, 100, 24, 15.0)


def measure(row: Row) -> None:
    """Print one row."""
    avatar = row.make()
    change = boxes.network(avatar) if row.network else None
    names = list(row.takes)
    held = [index for index, name in enumerate(names) if name.startswith("held")]
    with TemporaryDirectory() as folder:
        dumps = Path(folder) / "dumps"
        write_dumps(avatar, list(row.takes.values()), dumps, change=change, take_names=names, held_out=held)
        spent = time.process_time()
        result = make.distill(
            dumps,
            rig=avatar.rig if row.with_rig else None,
            morph_names=avatar.expression_names if row.with_rig else (),
            accept_error=True,
        )
        spent = time.process_time() - spent
        small, original = _bytes(result.avatar, Path(folder) / "a"), _bytes(avatar, Path(folder) / "b")
    errors, take = result.errors, result.task.dumps.drivers.take
    reached = []
    for index in held:
        at = take[errors.frames] == index
        reached.append(
            f"{np.sqrt(np.square(errors.rms_mm[at]).mean()):.4f} / {np.nanmean(errors.foreground_db[at]):.1f}"
        )
    print(f"{row.name}: {len(result.frames.fitted)} + {len(result.frames.held_out)} frames, {result.form}")
    print(f"  reached {'; '.join(reached)}  (mm / dB, held out)")
    for one in result.tried:
        print(f"  tried: {one.form} {one.errors.rms:.4f} mm, {one.errors.decibels:.1f} dB")
    if result.baked is not None:
        at = [take[result.baked.frames] == index for index in held]
        baked = "; ".join(f"{np.nanmean(result.baked.foreground_db[one]):.1f}" for one in at)
        print(f"  baked, an upper bound and not held out: {baked} dB")
    print(
        f"  normative bytes {small:,}, original {original:,}: {small / original:.2f} times; {spent:.0f} s CPU"
    )


def _bytes(avatar: Avatar, folder: Path) -> int:
    manifest = write_bundle(avatar, folder, preview=False, engine_files=False, reference=False)
    return sum(entry["bytes"] for entry in manifest["files"] if entry["path"] in NORMATIVE)


def lam() -> None:
    """A real LAM head, distilled from its own dumps and compared with what LAM's reader plays."""
    data = os.environ.get("AVATAR_TEST_DATA", ROOT.parent / "shared" / "data")
    path = Path(data) / "lam" / "p2-1.zip"
    if not path.exists():
        print("lam: optional test data is not here")
        return
    avatar = read(path)
    poses: list[Pose] = []
    if avatar.clips:
        poses = boxes.spread(clip_poses(avatar, avatar.clips[0].name), 60)
    takes = {
        "clip": poses,
        "random": random_poses(avatar, 120, 8.0),
        "held_random": random_poses(avatar, 24, 8.0, 8),
    }
    takes = {name: take for name, take in takes.items() if take}
    measure(Row("lam", lambda: avatar, takes))


def main() -> None:
    """Measure the rows that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("row", nargs="*")
    given = parser.parse_args()
    for row in rows():
        if not given.row or row.name in given.row:
            measure(row)
    if not given.row or "lam" in given.row:
        lam()
    if not given.row or "large" in given.row:
        large()
    if not given.row or "untaught" in given.row:
        untaught()
    print(f"peak memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB")


if __name__ == "__main__":
    main()
