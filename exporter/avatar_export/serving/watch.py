"""Watches the files of an avatar and loads it again when they have changed and are whole."""

from __future__ import annotations

import asyncio
import sys
from asyncio.subprocess import DEVNULL, PIPE
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from avatar_export.serving.session import Shown, shown
from avatar_export.serving.sources import Source, Stamp
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.packs import FILE_LIMIT

PERIOD = 0.25  # seconds between two looks
PATIENCE = 1.5  # seconds that an unsound file must rest before it counts as broken: a slow writer may go on


async def watch(
    source: Source,
    seen: Stamp,
    changed: Callable[[Shown], None],
    message: Callable[[str], None],
    *,
    period: float = PERIOD,
    patience: float = PATIENCE,
) -> None:
    """Calls `changed` with the avatar after each change, for ever; `seen` is the stamp of what is shown.

    A file must be the same in two looks before it is read. `message` is called with what is broken, and
    the avatar that is shown stays; "" takes the message away.
    """
    loop = asyncio.get_running_loop()
    last, since, tried = seen, loop.time(), seen
    while True:
        await asyncio.sleep(period)
        stamp = await asyncio.to_thread(source.stamp)
        if stamp != last:
            last, since = stamp, loop.time()
            continue
        rested = loop.time() - since
        if stamp == seen or (stamp == tried and rested < patience):
            continue
        try:
            avatar = await _load(source, message)
        except (AvatarError, OSError) as error:
            if stamp != tried:
                tried = stamp  # once more, when it has rested
            else:
                seen = stamp
                message(f"{' '.join(str(error).split())}; the last good one stays")
            continue
        seen = tried = stamp
        message("")
        changed(avatar)


async def _load(source: Source, message: Callable[[str], None]) -> Shown:
    """The avatar as it is now. It is packed in a process of its own, which ends with this task."""
    if source.is_whole():
        return await asyncio.to_thread(source.load)
    message(f"packing {source.path}")
    with TemporaryDirectory(prefix="avatar-export-") as work:
        pack = Path(work) / "pack.avatar"
        await _packed(source, pack)
        return await asyncio.to_thread(
            lambda: shown(source.id, read_bytes(pack, FILE_LIMIT), str(source.path))
        )


async def _packed(source: Source, pack: Path) -> None:
    command = (sys.executable, "-m", "avatar_export", "pack", "-o", pack, "--", source.path)
    packing = await asyncio.create_subprocess_exec(*command, stdout=DEVNULL, stderr=PIPE)
    try:
        _, said = await packing.communicate()
    finally:
        if packing.returncode is None:
            packing.kill()
            await packing.wait()
    if packing.returncode:
        last = said.decode(errors="replace").strip().rpartition("\n")[2]
        # It names the command, since it may advise options of it.
        raise AvatarError(
            f"`avatar-export pack` says: {last.removeprefix('avatar-export: ') or 'it cannot be packed'}"
        )
