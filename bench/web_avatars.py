"""The avatars of the web player's benchmark: a pack of each, and its Gaussians at rest as a PLY for peers.

    python -m bench.web_avatars OUT [--samples FOLDER] [--lam FILE]

It writes head.avatar and head.ply, the sample head of 70,000 Gaussians, and with --lam lam.avatar and lam.ply. Packs
have the default steps and every Gaussian of their source.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from avatar_export import read
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec.ply import encode
from bench.pack_avatars import sample_head


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path, help="folder to write to")
    parser.add_argument("--samples", type=Path, help="the sample head's checkpoint is made here, or reused")
    parser.add_argument("--lam", type=Path, help="a LAM avatar's zip")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        write(args.out, "head", sample_head(args.samples or Path(scratch)))
    if args.lam is not None:
        write(args.out, "lam", read(args.lam))


def write(folder: Path, name: str, source: Avatar) -> None:
    """NAME.avatar and NAME.ply."""
    avatar = with_active_sh(source)
    (folder / f"{name}.avatar").write_bytes(pack([avatar], Fineness()).file)
    (folder / f"{name}.ply").write_bytes(encode(avatar.gaussians))


if __name__ == "__main__":
    main()
