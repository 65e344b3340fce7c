"""Whether a stored USD file says what the avatar's own says. The stored one comes from anywhere: it is opened in a
process of its own, so that what crashes, hangs or fills the memory there ends nothing here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from avatar_runtime.io.errors import AvatarError

MAGIC = b"PXR-USDC"
SLACK = 1 << 16  # bytes; two releases of the library pack a layer to within half its size and this
SECONDS = 120
OLD, NEW = "old.usdc", "new.usdc"


def same_usd(old: bytes, new: bytes, seconds: float = SECONDS) -> str | None:
    """None where the USD crate file `old` says what `new` says, or one phrase naming the first difference.

    `new` is this program's; equal bytes are equal. Otherwise both have the same prims, properties and metadata but
    for the generator, and numbers within 1e-6 of their size plus 1e-9: another release of usd-core packs the same
    layer into other bytes. Nothing is composed, so that no reference of `old` is followed. Raises AvatarError if
    `old` cannot be read.
    """
    if bytes(old) == bytes(new):
        return None
    if not bytes(old[:8]) == MAGIC:
        raise AvatarError("is no USD crate file; convert again")
    if len(old) > len(new) + len(new) // 2 + SLACK:
        return f"{len(old)} bytes, expected about {len(new)}"
    with TemporaryDirectory() as folder:
        Path(folder, OLD).write_bytes(old)
        Path(folder, NEW).write_bytes(new)
        return _asked(folder, seconds)


def _asked(folder: str, seconds: float) -> str | None:
    """What `difference` finds, run by the same Python; -P, so that no pxr of the current folder is imported."""
    command = [sys.executable, "-P", "-m", "avatar_export.writers.usd.difference", folder]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(path for path in sys.path if Path(path).is_absolute()),
    }
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        raise AvatarError(f"takes USD more than {seconds:g} s to read; convert again") from None
    try:
        found: str | None = json.loads(done.stdout.splitlines()[-1])["difference"]
    except (IndexError, ValueError):  # it crashed, ran out of memory, or met a value that Python cannot hold
        raise AvatarError("is no USD crate file that can be read; convert again") from None
    return found
