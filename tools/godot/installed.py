"""The engine of this machine: the one that GODOT names, or the one that `tools.godot.fetch` unpacked."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
ROOT = "root"
STAMP = "versions.json"
XKBCOMP = "xkb"  # the folder of what Xvfb starts


class Missing(Exception):
    """Why there is no engine, in one line."""


@dataclass(frozen=True)
class Engine:
    """How its programs are started."""

    editor: tuple[str, ...]
    template: Path | None = None  # the export template, where it is known
    xvfb: tuple[str, ...] = ()
    xvfb_folder: Path | None = None  # that Xvfb must run in
    environment: Mapping[str, str] = field(default_factory=dict)


def folder() -> Path:
    """Where the fetched engine lies: .cache/godot, or AVATAR_GODOT_DIR."""
    return Path(os.environ.get("AVATAR_GODOT_DIR") or REPOSITORY / ".cache" / "godot").absolute()


def find() -> Engine:
    """The engine. Raises Missing."""
    named = os.environ.get("GODOT")
    if named:
        return _named(named)
    home = folder()
    if not (home / ROOT / STAMP).exists():
        raise Missing("no engine here: `make godot` gets one, GODOT=/path/to/godot uses another")
    return _fetched(home / ROOT)


def _named(program: str) -> Engine:
    """An engine that starts by itself, with the system's Vulkan and Xvfb; GODOT_TEMPLATE names its export template."""
    found, xvfb = shutil.which(program), shutil.which("Xvfb")
    if found is None:
        raise Missing(f"GODOT={program} is no program")
    template = os.environ.get("GODOT_TEMPLATE")
    return Engine((found,), Path(template) if template else None, (xvfb,) if xvfb else ())


def _fetched(root: Path) -> Engine:
    """Programs of sid on any Linux: each is started by the loader and the libraries it was unpacked with."""
    loader = next(root.glob("usr/lib/*/ld-linux*"))
    lib, binaries, share = loader.parent, root / "usr" / "bin", root / "usr" / "share"
    start = (str(loader), "--library-path", f"{lib}:{lib / 'pulseaudio'}")
    driver = str(next(share.glob("vulkan/icd.d/lvp_*.json")))
    return Engine(
        editor=(*start, str(binaries / "godot")),
        template=binaries / "godot-template-release",
        xvfb=(*start, str(binaries / "Xvfb"), "-xkbdir", str(share / "X11" / "xkb")),
        xvfb_folder=root / XKBCOMP,
        environment={
            "VK_DRIVER_FILES": driver,
            "VK_ICD_FILENAMES": driver,
            "LIBGL_DRIVERS_PATH": str(lib / "dri"),
            "__EGL_VENDOR_LIBRARY_DIRS": str(share / "glvnd" / "egl_vendor.d"),
        },
    )
