"""Loads a bundle: manifest, version, schema, sizes and hashes are checked before an array is used."""

from __future__ import annotations

import contextlib
import hashlib
import mmap
import stat
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from avatar_runtime.avatar import Avatar, Clip, Embedding, Enhancer, Gaussians, Relight, Rig
from avatar_runtime.checks import arguments
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import json_text, ply, safetensors
from avatar_runtime.codec import manifest as codec
from avatar_runtime.codec.clips import read_clip_tensors
from avatar_runtime.codec.embedding import read_embedding_tensors
from avatar_runtime.codec.tensors import read_gaussian_tensors, read_rig_tensors, tensor
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file
from avatar_runtime.packs import is_pack, placed, read_pack
from avatar_runtime.topology import topology_hash
from avatar_schema.validate import Problem, manifest_problems, version_problems

MANIFEST = "avatar.json"
MANIFEST_LIMIT = 4 << 20  # ours are tens of kilobytes
Data = bytes | memoryview
Open = Callable[[str, int], Data]  # (name, most bytes) -> contents


def load(path: str | Path, *, as_stored: bool = False) -> Avatar:
    """The avatar in a bundle folder, `.avatar.zip` or pack (`NAME.avatar`), in the right-handed frame.

    `as_stored` keeps the avatar of a left-handed bundle in its left-handed frame: for reference vectors of readers
    that do not mirror it. Derived files are not opened. The avatar of a pack is that of its finest level.

    Raises AvatarError for anything missing, altered, out of range or of a newer version. Bundles are data:
    nothing in them is executed. Raises TypeError for a `path` that is none.
    """
    path = arguments.path("path", path)
    if is_pack(path):
        pack = read_pack(path)
        if as_stored:
            return pack.avatar
        avatar = placed(pack.avatar)
        return avatar if handedness(pack.document["avatar"]) == "right" else mirrored(avatar)
    read = opener(path)
    document = read_manifest(read)
    errors = [p for p in manifest_problems(document) if not p.warning]
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise AvatarError(f"{errors[0].message}{more}", file=MANIFEST, field=errors[0].path)
    listed = {entry["path"]: entry for entry in document["files"]}

    def checked(name: str) -> Data:
        if name not in listed:
            raise AvatarError(f"does not list {name}", file=MANIFEST, field="$.files")
        return checked_bytes(read, listed[name])

    avatar = _avatar(document, checked)
    return avatar if as_stored or handedness(document) == "right" else mirrored(avatar)


def handedness(document: Mapping[str, Any]) -> str:
    """Frame of the normative files, right or left, in a manifest that the schema accepts."""
    return str(document["frame"]["handedness"])


def opener(path: Path) -> Open:
    """A function that reads a named file of a bundle folder or stored zip, up to a size."""
    if path.is_dir():
        return lambda name, limit: _read_file(path, name, limit)
    if not path.exists():
        raise AvatarError("no such file or folder", file=path)
    if not path.is_file() or not zipfile.is_zipfile(path):
        raise AvatarError("is neither a bundle folder nor a zip", file=path)

    def read(name: str, limit: int) -> bytes:
        try:
            with zipfile.ZipFile(path) as archive:
                info = archive.getinfo(name)
                if info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1:
                    raise AvatarError("must be stored, neither compressed nor encrypted", file=name)
                if info.file_size > limit:
                    raise AvatarError(f"is {info.file_size} bytes, expected at most {limit}", file=name)
                return archive.read(info)
        except KeyError:
            raise AvatarError(f"is missing from {path.name}", file=name) from None
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError) as error:
            raise AvatarError(f"cannot be read from {path.name} ({error})", file=name) from None

    return read


def read_manifest(read: Open) -> dict[str, Any]:
    """avatar.json, parsed; not yet checked beyond being a JSON object."""
    return read_json(read, MANIFEST, MANIFEST_LIMIT)


def read_json(read: Open, name: str, limit: int) -> dict[str, Any]:
    """A JSON object of at most `limit` bytes, whose numbers every reader can hold."""
    text = read(name, limit)
    try:
        document = json_text.parse(bytes(text), as_written=True)
    except ValueError as error:
        raise AvatarError(f"is not JSON ({error})", file=name) from None
    if not isinstance(document, dict):
        raise AvatarError("is not a JSON object", file=name)
    return document


def checked_bytes(read: Open, entry: dict[str, Any]) -> Data:
    """The bytes of a listed file, after its size and sha256 were compared with the manifest's."""
    name, size = entry["path"], entry["bytes"]
    data = read(name, size)
    if len(data) != size:
        raise AvatarError(f"is {len(data)} bytes, the manifest says {size}: copy the bundle again", file=name)
    digest = hashlib.sha256(data).hexdigest()
    if digest != entry["sha256"]:
        raise AvatarError(
            f"sha256 {digest[:12]}... is not the manifest's {entry['sha256'][:12]}...: "
            "the file was altered or damaged; copy or convert again",
            file=name,
        )
    return data


def warnings(path: str | Path) -> list[Problem]:
    """Problems of a bundle that `load` ignores, e.g. a newer minor version. Raises AvatarError as `load`."""
    if is_pack(Path(path)):
        return [p for p in version_problems(dict(read_pack(Path(path)).document)) if p.warning]
    return [p for p in manifest_problems(read_manifest(opener(Path(path)))) if p.warning]


def _avatar(document: dict[str, Any], checked: Callable[[str], Data]) -> Avatar:
    facts = codec.decode_facts(document)
    expressions, late = facts["expressions"], facts["eyelids"]
    gaussians = _gaussians(checked("gaussians.ply"), document["gaussians"])
    rig = _rig(document, checked, len(expressions), len(late))
    features = 9 * rig.corrective_joints.size if rig else 0
    tensors = safetensors.decode(checked("blendshapes.safetensors"), "blendshapes.safetensors")
    blendshapes, skin = read_gaussian_tensors(
        tensors,
        len(expressions),
        features,
        len(late),
        rig.joint_count if rig else 0,
        "blendshapes.safetensors",
    )
    return check_avatar(
        Avatar(
            **facts,
            gaussians=gaussians,
            groups=codec.decode_groups(document),
            blendshapes=blendshapes,
            skin=skin,
            rig=rig,
            embedding=_embedding(document, checked),
            clips=_clips(document, checked),
            enhancer=_enhancer(document, checked),
            relight=_relight(document, checked),
        )
    )


def _relight(document: dict[str, Any], checked: Callable[[str], Data]) -> Relight | None:
    said = document.get("relight")
    if said is None:
        return None
    name = "light.safetensors"
    normal = tensor(safetensors.decode(checked(name), name), "normal", name)
    if normal.dtype != np.float32:
        raise AvatarError(f"is {normal.dtype}, expected float32", file=name, field="normal")
    return codec.decode_relight(said, normal)


def _rig(document: dict[str, Any], checked: Callable[[str], Data], expressions: int, late: int) -> Rig | None:
    if document["joints"] is None:
        return None
    name = "rig.safetensors"
    tensors = safetensors.decode(checked(name), name)
    return read_rig_tensors(tensors, tuple(document["joints"]), expressions, late, name)


def _embedding(document: dict[str, Any], checked: Callable[[str], Data]) -> Embedding | None:
    said = document["embedding"]
    if said is None:
        return None
    name = "embedding.safetensors"
    embedding = read_embedding_tensors(safetensors.decode(checked(name), name), name)
    vertices, triangles = len(embedding.canonical_vertices), len(embedding.triangles)
    found = (vertices, triangles, topology_hash(embedding.triangles, vertices))
    if found != (said["vertices"], said["triangles"], said["topology_hash"]):
        raise AvatarError(
            f"holds {vertices} vertices in {triangles} triangles, topology {found[2][:12]}...; the manifest says "
            f"{said['vertices']}, {said['triangles']}, {said['topology_hash'][:12]}...",
            file=name,
        )
    return embedding


def _clips(document: dict[str, Any], checked: Callable[[str], Data]) -> tuple[Clip, ...]:
    if not document["clips"]:
        return ()
    name = "clips.safetensors"
    return read_clip_tensors(safetensors.decode(checked(name), name), document["clips"], name)


def _enhancer(document: dict[str, Any], checked: Callable[[str], Data]) -> Enhancer | None:
    """The enhancer. Its file is not parsed here: `avatar_runtime.enhance` checks it before running it."""
    said = document.get("enhancer")
    return None if said is None else codec.decode_enhancer(said, bytes(checked(codec.ENHANCER_FILE)))


def _gaussians(data: Data, said: dict[str, Any]) -> Gaussians:
    name = "gaussians.ply"
    gaussians = ply.gaussians(ply.decode(data, name), name)
    if gaussians.count != said["count"] or gaussians.sh_degree != said["sh_degree_stored"]:
        raise AvatarError(
            f"holds {gaussians.count} Gaussians of SH degree {gaussians.sh_degree}, the manifest says "
            f"{said['count']} of {said['sh_degree_stored']}",
            file=name,
        )
    return gaussians


def _read_file(bundle: Path, name: str, limit: int) -> Data:
    path = bundle / name
    try:
        # A link is refused, also one to a folder: it could lead out of the bundle.
        if not stat.S_ISREG(path.lstat().st_mode):
            raise AvatarError("is not a regular file", file=name)
        for folder in Path(name).parents[:-1]:
            if (bundle / folder).is_symlink():
                raise AvatarError(f"lies in {folder}, which is a link; copy the folder itself", file=name)
        with open_file(path) as file:
            size = path.stat().st_size
            if size > limit:
                raise AvatarError(f"is {size} bytes, expected at most {limit}", file=name)
            data = _buffer(size)
            return data[: file.readinto(data)].toreadonly()
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=name) from None


def _buffer(size: int) -> memoryview:
    """Memory for a file, in huge pages where the system has them: page faults of small pages cost more than reading."""
    if not size or not hasattr(mmap, "MADV_HUGEPAGE"):
        return memoryview(bytearray(size))
    room = mmap.mmap(-1, size, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with contextlib.suppress(OSError):
        room.madvise(mmap.MADV_HUGEPAGE)
    return memoryview(room)
