"""Gets Godot, its export template, a Vulkan without a GPU and Xvfb: `python -m tools.godot.fetch`.

They are packages of Debian's suite sid. apt resolves and checks them with a state of its own, from the mirror that it
is configured with; they are unpacked into a folder (see `installed.folder`). Nothing is installed, and no root is
needed. Run again it says what is there, without a net.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from tools.godot import VERSION, debian
from tools.godot.installed import ROOT, STAMP, XKBCOMP, Missing, find, folder

PACKAGES = ("godot", "godot-template-release", "mesa-vulkan-drivers", "libgl1-mesa-dri", "libegl1", "xvfb")
# What is kept of them, by the beginning of its path; LIB stands for the libraries of this machine.
KEPT = (
    "usr/bin/godot", "usr/bin/Xvfb", "usr/bin/xkbcomp", "usr/share/X11/xkb", "usr/share/xkeyboard-config-2",
    "usr/share/glvnd/egl_vendor.d", "usr/share/vulkan/icd.d/lvp_", "LIB/",
)  # fmt: skip
DROPPED = ("LIB/gconv", "LIB/libvulkan_", "LIB/perl")
BUT = ("LIB/libvulkan_lvp.so",)
# Where Xvfb looks for xkbcomp, of the same length as what it was compiled with: its working folder.
COMPILED_IN, WORKING_FOLDER = b"\0/usr/bin\0", b"\0././././\0"


def fetch() -> str:
    """What is there, in one line. Raises Missing."""
    if "GODOT" in os.environ:
        return f"Godot: {find().editor[0]}, which GODOT names"
    home = folder()
    made = stamp(home)
    if made is None or made["wanted"] != VERSION:
        made = get(home)
    other = "" if made["godot"].startswith(VERSION) else f" (this checkout is tested with {VERSION})"
    return f"Godot {made['godot']}{other}, Mesa {made['mesa-vulkan-drivers']}: {home}"


def stamp(home: Path) -> dict[str, str] | None:
    """Package -> version of what was unpacked; "wanted" is the version that was asked for."""
    try:
        read: dict[str, str] = json.loads((home / ROOT / STAMP).read_text())
        return read
    except (OSError, ValueError):
        return None


def get(home: Path) -> dict[str, str]:
    """Downloads and unpacks; what was there before is replaced when all is done."""
    start = time.monotonic()
    home.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=home, prefix="part-") as part:
        files = debian.download(PACKAGES, Path(part) / "apt")
        size = sum(file.stat().st_size for file in files)
        print(
            f"Godot: {len(files)} packages, {size / 1e6:.0f} MB, {time.monotonic() - start:.0f} s", flush=True
        )
        root = Path(part) / "root"
        lib = f"usr/lib/{debian.triplet()}"
        wanted = [[path.replace("LIB", lib) for path in paths] for paths in (KEPT, DROPPED, BUT)]
        for file in files:
            debian.unpack(file, root, *wanted)
        let_xvfb_start(root)
        versions = {"wanted": VERSION, **{name: debian.version(files, name) for name in PACKAGES}}
        (root / STAMP).write_text(json.dumps(versions, indent=1) + "\n")
        shutil.rmtree(home / ROOT, ignore_errors=True)
        root.rename(home / ROOT)
    return versions


def let_xvfb_start(root: Path) -> None:
    """Xvfb compiles a keymap at start, by a program at a fixed path: it gets one of the folder that it runs in."""
    program = root / "usr" / "bin" / "Xvfb"
    content = program.read_bytes()
    if content.count(COMPILED_IN) != 1:
        raise Missing(
            "Xvfb of this version looks for xkbcomp in another way; tools/godot/fetch.py must learn it"
        )
    program.write_bytes(content.replace(COMPILED_IN, WORKING_FOLDER))
    lib = next(root.glob("usr/lib/*/ld-linux*")).parent.relative_to(root)
    script = root / XKBCOMP / "xkbcomp"
    script.parent.mkdir()
    start = f"../{lib}/{next((root / lib).glob('ld-linux*')).name} --library-path ../{lib}"
    script.write_text(f'#!/bin/sh\nexec {start} ../usr/bin/xkbcomp "$@"\n')
    script.chmod(0o755)


def main() -> int:
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()
    try:
        print(fetch())
    except (Missing, OSError) as error:
        print(f"Godot was not run: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
