"""NAME.reference beside a pack: what a player must compute, stage by stage, and a small pack of the rows it uses.

cases.json, vectors.safetensors and the images are as in the folder reference/ of a bundle (SPEC.md section 16);
driving.json and driving.safetensors are those of driving; mini.avatar holds the rows and vertices that the vectors
use, as the same integers.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from avatar_export.packing.write import Prepared, driving_facts, write
from avatar_export.version import GENERATOR
from avatar_export.writers.reference import make_for, readable
from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance import (
    RUNTIME,
    Reference,
    Report,
    conform_driving,
    decode,
    decode_driving,
    driving_cases,
    encode_driving,
)
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import staged
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.packs import FILE_LIMIT, placed
from avatar_runtime.subset import subset

MINI = "mini.avatar"
SUFFIX = ".reference"
Files = dict[str, bytes]


def reference_folder(pack: Path) -> Path:
    """The folder of a pack's reference: NAME.reference for NAME.avatar."""
    return pack.with_suffix(SUFFIX)


def reference_of(avatar: Avatar, handedness: str, file: bytes) -> Files:
    """The files by name. `avatar` is what the pack `file` plays, as stored, in its own frame."""
    right = placed(mirrored(avatar) if handedness == "left" else avatar)
    pinned = {"pack": hashlib.sha256(file).hexdigest()}
    reference = make_for(right, avatar, handedness, pinned, RUNTIME)
    part = subset(avatar, reference.rows, reference.vertices).avatar
    assert part.packed is not None
    mini = write(Prepared((part,), part.packed.program, False), driving_facts(avatar), handedness=handedness)
    driving = driving_cases(avatar, handedness, GENERATOR)
    more = encode_driving(driving) if driving.cases else {}
    return {**readable(reference, avatar), **more, MINI: mini.file}


def read_pack_reference(pack: Path) -> Reference:
    """The reference in the folder beside a pack. Raises AvatarError without one, and for one of another pack."""
    folder = reference_folder(pack)
    if not folder.is_dir():
        raise AvatarError(
            "is missing, so there is nothing to compare with; `pack --reference` writes it", file=folder
        )
    reference = decode(lambda name, most: read_bytes(folder / name, most))
    if reference.files != {"pack": hashlib.sha256(read_bytes(pack, FILE_LIMIT)).hexdigest()}:
        raise AvatarError(f"was made for another {pack.name}; run `pack --reference` again", file=folder)
    return reference


def conform_pack_driving(pack: Path, avatar: Avatar) -> Report | None:
    """How the runtime's driving compares with the vectors beside a pack; None without vectors."""
    folder = reference_folder(pack)
    if not (folder / "driving.json").exists():
        return None
    return conform_driving(avatar, decode_driving(lambda name, most: read_bytes(folder / name, most)))


def refuse_folder(folder: Path, force: bool) -> None:
    """Raises AvatarError if `folder` exists, and is not a reference that `force` may replace."""
    if folder.exists() and not (force and (folder / MINI).is_file()):
        raise AvatarError("exists; move it away, or pass --force if it is a reference", file=folder)


def write_folder(folder: Path, files: Mapping[str, bytes], *, force: bool) -> None:
    """Writes all `files` or none; `force` replaces an older folder. Raises AvatarError as `staged`."""
    with staged(folder, force=force) as partial:
        partial.mkdir()
        for name, data in files.items():
            (partial / name).write_bytes(data)
