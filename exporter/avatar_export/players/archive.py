"""The archive in which npm and Unity's Package Manager take a package: same files, same bytes."""

from __future__ import annotations

import gzip
import io
import tarfile
from collections.abc import Mapping


def tarball(files: Mapping[str, bytes], top: str = "package") -> bytes:
    """A .tgz with `files` below the folder `top`, in the order of their paths, without times and owners."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for path, data in sorted(files.items()):
            entry = tarfile.TarInfo(f"{top}/{path}")
            entry.size, entry.mode = len(data), 0o644
            archive.addfile(entry, io.BytesIO(data))
    return gzip.compress(out.getvalue(), mtime=0)
