"""Triangle meshes from Wavefront .obj text, vertices and faces in the order of the file.

An embedding refers to ids of vertices and triangles, so nothing is merged, split or reordered.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avatar_runtime.avatar import F32, U32
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import opened

MAX_BYTES = 512 << 20
LARGEST_INDEX = 1 << 31


@dataclass(frozen=True)
class TriangleMesh:
    """Vertices and triangles, numbered as in the file."""

    vertices: F32  # [V, 3] units of the file
    triangles: U32  # [F, 3]


def read_obj(path: Path) -> TriangleMesh:
    """The mesh of an .obj file; see `parse_obj`. Raises AvatarError also for a file that cannot be read."""
    with opened(path, MAX_BYTES) as file:
        return parse_obj(file, path)


def parse_obj(lines: Iterable[bytes], file: object = None) -> TriangleMesh:
    """The mesh that lines of an .obj describe: `v x y z ...` and `f a b c`, `a/t`, `a//n`, `a/t/n`, `-1`.

    Text is parsed in double precision and then rounded, as libigl and torch do. Everything else, normals included, is
    skipped. Raises AvatarError with the line of a polygon, a missing, unsound or non-finite number, or an index that
    is 0 or beyond the vertices; and for a file without vertices or faces.
    """
    reader = _Reader(file)
    for number, line in enumerate(lines, 1):
        words = line.partition(b"#")[0].split(None, 4)
        read = KEYWORDS.get(words[0]) if words else None
        if read is not None:
            read(reader, number, words[1:])
    return reader.mesh()


class _Reader:
    def __init__(self, file: object) -> None:
        self.file = file
        self.coordinates = array("d")
        self.corners = array("q")
        self.face_lines = array("q")

    def vertex(self, number: int, words: list[bytes]) -> None:
        try:
            x, y, z = map(float, words[:3])
        except ValueError:
            raise self.wrong(number, f"'v' needs three numbers, got {_shown(words)}") from None
        self.coordinates.extend((x, y, z))

    def face(self, number: int, words: list[bytes]) -> None:
        if len(words) != 3:
            what = f"has {len(words)} corners" if len(words) < 3 else "has more than three corners"
            raise self.wrong(
                number, f"the face {what}; triangulate the mesh, keeping the order of its vertices"
            )
        for word in words:
            try:
                index = int(word.partition(b"/")[0])
            except ValueError:
                index = 0
            if not 0 < abs(index) < LARGEST_INDEX:
                raise self.wrong(
                    number,
                    f"{_shown([word])} is not a corner; 'v', 'v/vt', 'v//vn' or 'v/vt/vn' is expected, v from 1",
                )
            self.corners.append(index - 1 if index > 0 else len(self.coordinates) // 3 + index)
        self.face_lines.append(number)

    def mesh(self) -> TriangleMesh:
        if not self.coordinates or not self.corners:
            raise AvatarError(f"has no {'faces' if self.coordinates else 'vertices'}", file=self.file)
        with np.errstate(over="ignore"):  # becomes infinite, which is refused below
            vertices = np.frombuffer(self.coordinates, np.float64).reshape(-1, 3).astype(np.float32)
        finite = np.isfinite(vertices).all(axis=1)
        if not finite.all():
            raise AvatarError(f"vertex {int(np.argmin(finite)) + 1} is not finite in float32", file=self.file)
        corners = np.frombuffer(self.corners, np.int64).reshape(-1, 3)
        outside = ((corners < 0) | (corners >= len(vertices))).any(axis=1)
        if outside.any():
            at = int(np.argmax(outside))
            raise self.wrong(
                self.face_lines[at],
                f"face {at} has corners {', '.join(str(c + 1) for c in corners[at])}, "
                f"but there are vertices 1..{len(vertices)}",
            )
        return TriangleMesh(vertices, corners.astype(np.uint32))

    def wrong(self, number: int, message: str) -> AvatarError:
        return AvatarError(message, file=self.file, field=f"line {number}")


KEYWORDS = {b"v": _Reader.vertex, b"f": _Reader.face}


def _shown(words: list[bytes]) -> str:
    return repr(b" ".join(words)[:40].decode("ascii", errors="replace").replace("\ufffd", "?"))
