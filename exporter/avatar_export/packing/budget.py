"""What no step makes smaller: the floor of a file, found before anything is searched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from avatar_export.notes.note import Note, fact
from avatar_export.notes.text import text
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.balance import Balance
from avatar_export.packing.search import COARSEST, PARTS
from avatar_export.packing.steps import STEPS, Fineness
from avatar_export.packing.write import Packing
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError

PARTS_OF_FILE = {  # the first part of a tensor's name -> what a person calls it
    "document": "Names, passes and figures",
    "preview": "Preview",
    "rig": "Skeleton and triangles",
    "MorphStatic": "Mesh and its morphs",
    "SkinStatic": "Skin weights of the mesh",
    "SurfaceStatic": "Triangles under the Gaussians",
    "BlendStatic": "Gaussians and their expressions",
    "BindStatic": "Skin weights of the Gaussians",
    "EmbedStatic": "Places of the Gaussians on the mesh",
    "LightStatic": "Normals of the Gaussians",
    "CornerStatic": "Triangles that cast shadows",
    "clips": "Clips",
}
# Shrink with the number of Gaussians.
OF_GAUSSIANS = ("BlendStatic", "BindStatic", "EmbedStatic", "LightStatic")
WITHOUT = {  # part -> how to do without it
    "Clips": "make it from a source without clips",
    "Preview": "--no-preview",
}


def by_part(packing: Packing) -> dict[str, int]:
    """Bytes in the file by part, the largest first; levels below the finest are parts of their own."""
    found: dict[str, int] = {}
    for tensor, size in packing.sizes.items():
        level, first = _place(tensor)
        name = PARTS_OF_FILE.get(first, first) + (f", {level}" if level else "")
        found[name] = found.get(name, 0) + size
    return dict(sorted(found.items(), key=lambda item: -item[1]))


@dataclass(frozen=True)
class Floor:
    """The least that a pack of an avatar takes."""

    bytes: int  # with the fewest Gaussians that a search keeps
    parts: Mapping[str, int]  # bytes of what no step and no merging makes smaller, the largest first

    def note(self) -> Note:
        """The same for people."""
        return fact("floor", parts=self.parts, bytes=self.bytes)


def coarsest(levels: Sequence[Avatar]) -> tuple[list[Avatar], Fineness]:
    """What the floor is found with: no directions of colour, and the coarsest steps."""
    plain = [with_active_sh(replace(level, sh_degree=0)) for level in levels]
    return plain, Balance(dict.fromkeys(STEPS, 1.0), 0.0).fine(COARSEST)


def floor(packing: Packing) -> Floor:
    """The floor of an avatar, from the pack of its `coarsest`."""
    parts, whole = dict[str, int](), 0.0
    for tensor, size in packing.sizes.items():
        first = _place(tensor)[1]
        if first in OF_GAUSSIANS:
            whole += PARTS[-1] * size
        else:
            name = PARTS_OF_FILE.get(first, first)
            parts[name] = parts.get(name, 0) + size
    fixed = sum(parts.values())
    return Floor(round(fixed + whole), dict(sorted(parts.items(), key=lambda item: -item[1])))


def refuse_below(found: Floor, max_bytes: int) -> None:
    """Raises AvatarError for a budget below the floor; it names what could be left out."""
    if max_bytes >= found.bytes:
        return
    cures = [f"{how} ({found.parts[part]} bytes)" for part, how in WITHOUT.items() if found.parts.get(part)]
    more = f"leave something out ({', '.join(cures)}), or give more" if cures else "give more"
    raise AvatarError(f"{max_bytes} bytes cannot be met; {text(found.note())}; {more}", field="--max-bytes")


def _place(tensor: str) -> tuple[str, str]:
    """(name of a coarser level or "", first part of the name) of a tensor."""
    level, slash, rest = tensor.partition("/")
    coarse = level if slash and level.startswith("level") else ""
    return coarse, (rest if coarse else tensor).partition("/")[0].partition(".")[0]
