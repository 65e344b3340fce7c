"""The avatars that `bench.packs` packs."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from avatar_export import ReadOptions, read
from avatar_export.driving.matrix import with_driving
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks.avatar import check_avatar
from bench.backends import with_sh_deltas

TRAINED = Path(__file__).parents[1] / "samples" / "trained"
FACE_GAUSSIANS = 58_333  # 69,999 with the teeth


@dataclass(frozen=True)
class Limited:
    """An avatar to pack, and the size that its pack is held to."""

    load: Callable[[Path], Avatar]  # from the folder of samples
    limit_mb: float


def trained(name: str) -> Callable[[Path], Avatar]:
    """A trained sample of the repository."""
    return lambda _: read(TRAINED / name)


def sample_head(folder: Path) -> Avatar:
    """The sample head with SH of degree 3 and 51 expressions; its checkpoint is made in `folder` if it is not there."""
    base = folder / "gaussian_blendshapes"
    if not base.exists():
        flags = ("--system", "gaussian_blendshapes", "--gaussians", str(FACE_GAUSSIANS), "--form", "dump")
        command = [sys.executable, "-m", "samples.make", str(folder), *flags]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    avatar = read(base / "model", ReadOptions(dataset=base))
    return check_avatar(with_driving(avatar, base / "driving.json"))


AVATARS: Mapping[str, Limited] = {
    "head_blendshapes": Limited(trained("head_blendshapes"), 1.44),
    "head_splatting": Limited(trained("head_splatting"), 0.9),
    "body_splatting": Limited(trained("body_splatting"), 0.4),
    "head_points": Limited(trained("head_points"), 2.04),
    "asm_face": Limited(trained("head_bones.npz"), 1.2),
    "head_70000": Limited(sample_head, 5.2),
    "head_70000_sh_deltas": Limited(lambda folder: with_sh_deltas(sample_head(folder)), 11),
}
LAM = Limited(read, 1.5)  # only with --lam: the file is not part of the project
