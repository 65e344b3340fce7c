"""ASM faces in files: an .npz with a whole face, and a small .npz of a person without the template.

Stored `.npy` entries, no compression and no dates: same face, same bytes. Keys, shapes and units are described
in schema/ASM.md. Large arrays are float32.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm.check import check_face, check_template
from avatar_export.asm.model import AsmFace, Binding, Take, Template
from avatar_export.formats.archive import Archive
from avatar_export.formats.casts import as_float32, as_float64
from avatar_export.formats.npy import parse_npy, parse_text_npy
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import of_file

ASM_VERSION = 1
MAX_ARRAY_BYTES = 1 << 30
DATE = (1980, 1, 1, 0, 0, 0)  # the earliest date of a zip, so that the same input gives the same bytes
TEMPLATE_HASH = "template_sha256"

Array = npt.NDArray[Any]
Arrays = dict[str, Array]


def save(face: AsmFace, path: Path) -> None:
    """Write a whole face. Raises AvatarError for a face that is unsound after rounding to float32."""
    stored = _rounded(face)
    _write(_template_arrays(stored.template) | _person_arrays(stored), path)


def save_person(face: AsmFace, path: Path) -> None:
    """Write a person without the template, for `load_person`. Raises as `save`."""
    stored = _rounded(face)
    _write({TEMPLATE_HASH: np.array([template_hash(stored.template)])} | _person_arrays(stored), path)


def load(path: Path) -> AsmFace:
    """The face that `save` wrote. Raises AvatarError for another file, a newer version, or unsound data."""
    source = _Source(path)
    if TEMPLATE_HASH in source:
        raise AvatarError(
            "holds a person without the template; a face with its template is needed", file=path
        )
    return _checked(source, _read_template(source))


def load_person(path: Path, template: Template) -> AsmFace:
    """The person that `save_person` wrote, on the template that they were fitted with; a whole face is read unchanged.

    Raises AvatarError as `load`, and for another template.
    """
    source = _Source(path)
    if TEMPLATE_HASH not in source:
        return load(path)
    wanted, given = source.word(TEMPLATE_HASH), template_hash(template)
    if wanted != given:
        raise AvatarError(
            f"was fitted with another template (sha256 {wanted[:12]!a}..., given {given[:12]}...)", file=path
        )
    return _checked(source, template)


def is_face(path: Path) -> bool:
    """Whether `path` is an .npz with the array asm_version; never raises."""
    try:
        if not path.is_file():
            return False
        with Archive(path) as archive:
            return "asm_version.npy" in archive.names
    except (AvatarError, OSError):
        return False


def is_person(path: Path) -> bool:
    """Whether `path` holds a person without the template. Raises AvatarError if it is not a zip."""
    with Archive(path) as archive:
        return f"{TEMPLATE_HASH}.npy" in archive.names


def template_hash(template: Template) -> str:
    """sha256 (hex) of the template's entries as `save` writes them, sorted by name."""
    digest = hashlib.sha256()
    for name, data in sorted(_entries(_template_arrays(template)).items()):
        digest.update(name.encode() + b"\0" + data)
    return digest.hexdigest()


def _rounded(face: AsmFace) -> AsmFace:
    """The face as `load` will read it."""
    check_face(face)
    b = face.binding
    binding = Binding(*map(_float32, (b.zeta, b.pi, b.mu, b.covariance)))
    takes = tuple(
        Take(t.name, t.fps, *map(_float32, (t.rotation_vector, t.translation, t.scale))) for t in face.takes
    )
    return check_face(replace(face, binding=binding, takes=takes))


def _float32(array: Array) -> Array:
    return as_float64(as_float32(array))


def _template_arrays(template: Template) -> Arrays:
    names = list(template.landmarks)
    arrays: Arrays = {
        "vertices": template.vertices.astype("<f4"),
        "triangles": template.triangles.astype("<u4"),
        "uv": template.uv.astype("<f4"),
        "bone_names": np.array(template.bone_names),
        "parents": template.parents.astype("<i4"),
        "rest_position": template.rest_position.astype("<f4"),
        "rest_linear": template.rest_linear.astype("<f4"),
        "anchor_vertex": template.anchor_vertex.astype("<u4"),
        "weight_rule": np.array([template.weight_rule]),
    }
    if template.colour is not None:
        arrays["colour"] = template.colour.astype("<f4")
    if names:
        arrays["landmark_names"] = np.array(names)
        arrays["landmark_vertices"] = np.array([template.landmarks[n] for n in names], "<u4")
    return arrays


def _person_arrays(face: AsmFace) -> Arrays:
    b, takes = face.binding, face.takes
    bones = len(b.zeta)
    flat = [b.zeta, b.pi, b.mu.reshape(bones, -1), b.covariance.reshape(bones, -1)]
    tau = [np.concatenate([t.rotation_vector, t.translation, t.scale], axis=2) for t in takes]
    return {
        "asm_version": np.array(ASM_VERSION, "<u4"),
        "name": np.array([face.name]),
        "binding": np.concatenate(flat, axis=1).astype("<f4"),
        "tau": np.concatenate(tau).astype("<f4"),
        "take_names": np.array([t.name for t in takes]),
        "take_frames": np.array([len(t.scale) for t in takes], "<u4"),
        "take_fps": np.array([t.fps for t in takes], "<f8"),
    }


def _entries(arrays: Mapping[str, Array]) -> dict[str, bytes]:
    entries = {}
    for name, array in arrays.items():
        stream = io.BytesIO()
        np.lib.format.write_array(stream, np.ascontiguousarray(array), version=(1, 0), allow_pickle=False)
        entries[f"{name}.npy"] = stream.getvalue()
    return entries


def _write(arrays: Mapping[str, Array], path: Path) -> None:
    try:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
            for name, data in _entries(arrays).items():
                archive.writestr(zipfile.ZipInfo(name, DATE), data)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=path) from None


class _Source:
    """The arrays of a file, read by name."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with Archive(path) as archive:
            self._data = {
                name.removesuffix(".npy"): archive.read(name, MAX_ARRAY_BYTES) for name in archive.names
            }
        if "asm_version" not in self:
            raise AvatarError("has no array asm_version, so it is not an ASM face", file=path)
        version = self.numbers("asm_version")
        if version.dtype.kind not in "iu" or version.size != 1 or int(version.reshape(-1)[0]) != ASM_VERSION:
            raise AvatarError(
                f"has version {str(version)[:20]}; this program reads version {ASM_VERSION}", file=path
            )

    def __contains__(self, name: str) -> bool:
        return name in self._data

    def numbers(self, name: str) -> Array:
        """An array as stored. Raises AvatarError if it is missing."""
        return np.asarray(parse_npy(self._bytes(name), self.path, name).read())

    def words(self, name: str) -> tuple[str, ...]:
        """A list of strings. Raises AvatarError if it is missing."""
        return parse_text_npy(self._bytes(name), self.path, name)

    def word(self, name: str) -> str:
        """One string. Raises AvatarError if it is missing."""
        words = self.words(name)
        if len(words) != 1:
            raise AvatarError(f"expected one string, got {len(words)}", file=self.path, field=name)
        return words[0]

    def _bytes(self, name: str) -> bytes:
        if name not in self._data:
            raise AvatarError("is missing", file=self.path, field=name)
        return self._data[name]


def _read_template(source: _Source) -> Template:
    landmarks: dict[str, int] = {}
    if "landmark_names" in source:
        names, rows = source.words("landmark_names"), source.numbers("landmark_vertices")
        if rows.shape != (len(names),) or rows.dtype.kind not in "iu" or len(set(names)) != len(names):
            raise AvatarError("does not match landmark_names", file=source.path, field="landmark_vertices")
        landmarks = dict(zip(names, rows.tolist(), strict=True))
    return Template(
        vertices=_floats(source, "vertices"),
        triangles=_whole(source, "triangles", np.uint32),
        uv=_floats(source, "uv"),
        bone_names=source.words("bone_names"),
        parents=_whole(source, "parents", np.int32),
        rest_position=_floats(source, "rest_position"),
        rest_linear=_floats(source, "rest_linear"),
        anchor_vertex=_whole(source, "anchor_vertex", np.uint32),
        weight_rule=source.word("weight_rule"),
        colour=_floats(source, "colour") if "colour" in source else None,
        landmarks=landmarks,
    )


def _floats(source: _Source, name: str) -> Array:
    array = source.numbers(name)
    if array.dtype.kind != "f":
        raise AvatarError(f"expected floats, got {array.dtype}", file=source.path, field=name)
    return as_float32(array)


def _whole(source: _Source, name: str, kind: type[np.generic]) -> Array:
    array = source.numbers(name)
    limits = np.iinfo(kind)  # type: ignore[type-var]
    if array.dtype.kind not in "iu" or (
        array.size and (array.min() < limits.min or array.max() > limits.max)
    ):
        raise AvatarError(
            f"expected whole numbers of {limits.dtype}, got {array.dtype}", file=source.path, field=name
        )
    return array.astype(kind)


def _checked(source: _Source, template: Template) -> AsmFace:
    with of_file(source.path):
        check_template(template)
        return check_face(_read_person(source, template))


def _read_person(source: _Source, template: Template) -> AsmFace:
    bones = len(template.bone_names)
    packed = as_float64(source.numbers("binding"))
    k = (packed.shape[1] - 2) // 6 if packed.ndim == 2 else 0
    if packed.shape != (bones, 2 + 6 * k) or k < 1:
        raise AvatarError(
            f"expected [{bones}, 2 + 6 K], one row per bone, got {list(packed.shape)}", field="binding"
        )
    zeta, pi, mu, covariance = np.split(packed, [2, 2 + k, 2 + 3 * k], axis=1)
    binding = Binding(zeta, pi, mu.reshape(bones, k, 2), covariance.reshape(bones, k, 3))
    return AsmFace(source.word("name"), template, binding, _read_takes(source, bones))


def _read_takes(source: _Source, bones: int) -> tuple[Take, ...]:
    names, frames, fps = source.words("take_names"), source.numbers("take_frames"), source.numbers("take_fps")
    if frames.dtype.kind not in "iu" or frames.shape != (len(names),) or fps.shape != (len(names),):
        raise AvatarError("does not match take_names and take_fps", field="take_frames")
    tau = as_float64(source.numbers("tau"))
    counts = [int(count) for count in frames.tolist()]
    if min(counts, default=0) < 0:
        raise AvatarError("is negative", field=f"take_frames[{int(np.argmin(counts))}]")
    if tau.shape != (sum(counts), bones, 9):
        raise AvatarError(
            f"expected [{sum(counts)}, {bones}, 9]: frames, bones, tau; got {list(tau.shape)}", field="tau"
        )
    ends = np.cumsum([0, *counts])
    return tuple(
        Take(name, float(rate), *(tau[a:b, :, at : at + 3] for at in (0, 3, 6)))
        for name, rate, a, b in zip(names, fps.tolist(), ends[:-1], ends[1:], strict=True)
    )
