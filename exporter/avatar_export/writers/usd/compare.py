"""Whether a stored USD file has the content that the avatar gives. The stored file is untrusted: it is opened in a
separate process, so that a crash, an endless loop or full memory does no harm here.
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
SLACK = 1 << 16  # bytes; sizes of a layer by two releases of the library differ by less than half and this
SECONDS = 120
OLD, NEW = "old.usdc", "new.usdc"


def same_usd(old: bytes, new: bytes, seconds: float = SECONDS) -> str | None:
    """None if the USD crate file `old` has the content of `new`, else one phrase that names the first difference.

    `new` is written by this program. Contents are equal if the bytes are, or if both have the same prims, properties
    and metadata except the generator, with numbers within 1e-6 of their magnitude plus 1e-9: another release of
    usd-core packs the same layer into other bytes. Nothing is composed, so that no reference of `old` is followed.
    Raises AvatarError if `old` cannot be read.
    """
    if bytes(old) == bytes(new):
        return None
    if not bytes(old[:8]) == MAGIC:
        raise AvatarError("is not a USD crate file; convert again")
    if len(old) > len(new) + len(new) // 2 + SLACK:
        return f"{len(old)} bytes, expected about {len(new)}"
    with TemporaryDirectory() as folder:
        Path(folder, OLD).write_bytes(old)
        Path(folder, NEW).write_bytes(new)
        return _asked(folder, seconds)


def _asked(folder: str, seconds: float) -> str | None:
    """The output of `difference`, run by the same Python; with -P, so that no pxr of the current folder is imported."""
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
        raise AvatarError(f"takes more than {seconds:g} s to read; convert again") from None
    try:
        found: str | None = json.loads(done.stdout.splitlines()[-1])["difference"]
    except (
        IndexError,
        ValueError,
    ):  # it crashed, ran out of memory, or found a value that Python cannot represent
        raise AvatarError("is not a USD crate file that can be read; convert again") from None
    return found
