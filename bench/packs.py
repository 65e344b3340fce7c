"""Packs against their limits: bytes, what they claim, time and memory, one row an avatar.

    python -m bench.packs [--only NAME ...] [--claims] [--samples FOLDER] [--lam FILE]

Each avatar is packed by default. A row passes if its bytes without clips are within the limit, and if what it claims
is what packs aim at. With `--claims` a judge draws 200 poses and 3 views of its own (`tests/oracles/pack_claims.py`):
the mean may be 0.5 dB and the worst image 2 dB below the claim. Time is the CPU's of the command's work, reading left
out; time and memory of a pack whose steps are given are those of a process of its own.
"""

from __future__ import annotations

import argparse
import json
import pickle
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tests.oracles.pack_claims import judged

from avatar_export.measure.claims import claim_poses
from avatar_export.measure.framing import preview_webp
from avatar_export.measure.views import in_turn, views
from avatar_export.measure.yardstick import compare
from avatar_export.notes.text import text
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.make import Made, pack_of
from avatar_export.packing.search import aims_of
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import Packing, pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec import pack as file_codec
from avatar_runtime.packs import decode_pack, placed
from avatar_runtime.program.check import check_program
from bench.backends import backend_rows
from bench.pack_avatars import AVATARS, LAM, Limited

MB = 1e6
CLIP_SHARE = 0.2  # of the float32 size


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=[*AVATARS, "lam"], help="these rows alone")
    parser.add_argument("--samples", type=Path, help="the sample head's checkpoint is made here, or reused")
    parser.add_argument("--lam", type=Path, help="a LAM avatar's zip of 20,018 Gaussians")
    parser.add_argument("--claims", action="store_true", help="judge what each pack claims")
    parser.add_argument("--once", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.once is not None:
        print(json.dumps(packed_once(pickle.loads(args.once.read_bytes()))))
        return
    with tempfile.TemporaryDirectory() as scratch:
        folder = args.samples or Path(scratch)
        for name in args.only or [*AVATARS, "lam"]:
            if name != "lam":
                show(name, AVATARS[name], AVATARS[name].load(folder), Path(scratch), args.claims)
            elif args.lam is not None:
                show(name, LAM, LAM.load(args.lam), Path(scratch), args.claims)
            else:
                print("lam: left out; its file is not part of the project, give it with --lam")


def pack_rows(source: Avatar) -> list[tuple[str, float, str]]:
    """Size and error of a pack of `source` with the default steps, and its frames on `cpu` and `gl`."""
    avatar = with_active_sh(source)
    made = pack([avatar], Fineness())
    shown = claim_poses(avatar)
    played = placed(decode_pack(made.file, "bench").avatar)
    measured = compare(avatar, [played], in_turn(shown, views(avatar, 512, shown[::4])))[0]
    rows = [("pack_bytes", len(made.file) / MB, "MB"), ("pack_psnr_mask", measured.mean, "dB")]
    frames = backend_rows(played, ("cpu_1_thread", "cpu_2_threads", "gl"))
    return rows + [(f"packed_{name}", value, unit) for name, value, unit in frames]


def show(name: str, limited: Limited, avatar: Avatar, scratch: Path, claims: bool) -> None:
    """Prints the row of one avatar."""
    source = scratch / "source.pickle"
    source.write_bytes(pickle.dumps(avatar))
    command = [sys.executable, "-m", "bench.packs", "--once", str(source)]
    once = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    made, seconds = packed_by_default(avatar)
    print(f"{name}: {avatar.gaussians.count} Gaussians")
    for line in (*figures(made, limited, avatar, once["clips"]), *map(text, made.notes)):
        print(f"  {line}")
    if claims:
        print(f"  {claim_line(avatar, made)}")
    if avatar.clips:
        size = sum(array.nbytes for clip in avatar.clips for array in clip_arrays(clip))
        verdict = passed(once["clips"] <= CLIP_SHARE * size)
        print(f"  clips: {once['clips']} bytes, {once['clips'] / size:.3f} of float32 (limit 0.2): {verdict}")
    print(f"  search, packing and claim: {seconds:.1f} s CPU")
    print(
        f"  packing with given steps: {once['cpu']:.1f} s CPU, peak {once['peak_mb']:.0f} MB; reading: inflating "
        f"and checking {once['check']:.3f} s, dequantising {once['dequantise']:.3f} s"
    )
    sys.stdout.flush()


def figures(made: Made, limited: Limited, avatar: Avatar, clips: int) -> list[str]:
    """Bytes and claim beside their limits."""
    size, measured, aims = len(made.file) - clips, made.measured[0], aims_of(avatar, None)
    return [
        f"{size / MB:.3f} MB (limit {limited.limit_mb:g}): {passed(size <= limited.limit_mb * MB)}",
        f"claims {measured.mean:.2f} dB (aim {aims.mean:g}): {passed(measured.mean >= aims.mean)}",
        f"claims {measured.worst:.2f} dB the worst (aim {aims.worst:g}): {passed(measured.worst >= aims.worst)}",
    ]


def claim_line(avatar: Avatar, made: Made) -> str:
    """What the judge finds beside what the pack claims."""
    claim = made.measured[0]
    found = judged(avatar, placed(decode_pack(made.file, "bench").avatar))
    return (
        f"judged in {found.images} other images: {found.mean:.2f} dB ({found.mean - claim.mean:+.2f}), "
        f"{found.worst:.2f} dB the worst ({found.worst - claim.worst:+.2f}), a pixel off by {found.pixel:.0f} of 255: "
        f"{passed(found.keeps(claim.mean, claim.worst))}"
    )


def passed(good: bool) -> str:
    """A verdict for people."""
    return "PASS" if good else "short"


def packed_by_default(avatar: Avatar) -> tuple[Made, float]:
    """(the pack, CPU seconds that it took, with its claim)."""
    before = time.process_time()
    made = pack_of(avatar)
    return made, time.process_time() - before


def packed_once(avatar: Avatar) -> Mapping[str, Any]:
    """Figures of one pack with the default steps, made in this fresh process."""
    avatar = with_active_sh(avatar)
    before = time.process_time()
    made = pack([avatar], Fineness(), None, preview_webp(avatar))
    cpu = time.process_time() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MB
    clips = sum(size for name, size in made.sizes.items() if name.startswith("clips."))
    check, whole = reading_seconds(made)
    return {
        "cpu": cpu,
        "peak_mb": peak,
        "bytes": len(made.file) - clips,
        "clips": clips,
        "check": check,
        "dequantise": whole - check,
    }


def reading_seconds(made: Packing) -> tuple[float, float]:
    """CPU seconds: inflating and checking; those and making the avatar. The least of three."""
    checks, wholes = [], []
    for _ in range(3):
        before = time.process_time()
        held = file_codec.decode(made.file, "pack")
        check_program(held.program, min(len(level["groups"]) for level in held.document["levels"]))
        checks.append(time.process_time() - before)
        before = time.process_time()
        decode_pack(made.file, "pack")
        wholes.append(time.process_time() - before)
    return min(checks), min(wholes)


def clip_arrays(clip: Any) -> list[Any]:
    """The arrays of a clip."""
    return [clip.expression_weights, clip.late_weights, clip.joint_delta, clip.world_from_avatar]


if __name__ == "__main__":
    main()
