"""The files beside SplattingAvatar's point_cloud.ply: embedding.json in both its forms, and config.yaml."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from avatar_export.formats.json_text import json_fault
from avatar_export.formats.point_cloud import PointCloud, first_file
from avatar_runtime.avatar import F32, F64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

CONFIG = "config.yaml"
# File -> its keys for the mesh file and the weights; the second form is that of the first release.
FORMS = {"embedding.json": ("cano_mesh", "sample_bary"), "canonical.sample.json": ("mesh_fn", "_sample_bary")}
# One Gaussian takes about 190 bytes, 15 commas and 3 brackets. Much larger files are not parsed: Python lists need many
# times the memory of their text.
MAX_BYTES, MAX_COMMAS, MAX_BRACKETS = 1024, 32, 8
MIN_ROWS = 1024  # minimum for these limits, for keys that are not per Gaussian
MAX_CONFIG_BYTES = 1 << 16


@dataclass(frozen=True)
class StoredEmbedding:
    """The embedding as stored, in training units; numbers are finite, but not checked otherwise."""

    file: Path
    mesh: Path  # beside `file`; the folder that the file names is ignored
    mesh_as_named: str
    weights_key: str
    triangle: F64  # [N]
    barycentric: F32  # [N, 3]
    uvd: F32  # [N, 3]; only the third number, the displacement, is used
    quat_wxyz: F32 | None  # [N, 4] not normalised; None: use that of the .ply


def find_embedding(cloud: PointCloud) -> Path | None:
    """The embedding beside the .ply, of two forms the newer, if there is one."""
    return first_file(cloud.file.parent / name for name in FORMS)


def read_embedding(path: Path, count: int) -> StoredEmbedding:
    """The embedding of `count` Gaussians.

    Raises AvatarError for other JSON, a missing key, another number of rows, and for a row with a value that is not a
    finite number. Source: SplattingAvatar 3847314 splatting_avatar_model.py
    load_from_embedding and load_from_embedding_v2.
    """
    mesh_key, weights_key = FORMS[path.name]
    document = _Document(path, count)
    named = document.text(mesh_key)
    bare = re.split(r"[\\/]", named)[-1]
    if not bare.isprintable() or not 1 <= len(bare) <= 200 or bare.startswith("."):
        raise AvatarError("is not a file name", file=path, field=mesh_key)
    return StoredEmbedding(
        path,
        path.parent / bare,
        named,
        weights_key,
        document.numbers("sample_fidxs", 1)[:, 0],
        document.floats(weights_key, 3),
        document.floats("_xyz", 3),
        document.floats("_rotation", 4) if "_rotation" in document else None,
    )


class _Document:
    """The object in an embedding's file."""

    def __init__(self, path: Path, count: int) -> None:
        self._path = path
        self._count = count
        try:
            self._values = json.loads(self._bytes(), parse_constant=_refuse_constant)
        except (ValueError, RecursionError) as error:
            raise AvatarError(f"is not valid JSON ({json_fault(error)})", file=path) from None
        if not isinstance(self._values, dict):
            raise AvatarError("is not a JSON object", file=path)

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def text(self, key: str) -> str:
        value = self._value(key)
        if not isinstance(value, str):
            raise AvatarError("is not text", file=self._path, field=key)
        return value

    def floats(self, key: str, width: int) -> F32:
        """[N, width] as float32, rounded as torch does."""
        numbers = self.numbers(key, width)
        with np.errstate(over="ignore"):
            values = numbers.astype(np.float32)
        finite = np.isfinite(values).all(axis=1)
        if not finite.all():
            at = int(np.argmin(finite))
            raise AvatarError(
                f"is {numbers[at].tolist()}, which is not finite in float32",
                file=self._path,
                field=f"{key}[{at}]",
            )
        return values

    def numbers(self, key: str, width: int) -> F64:
        """[N, width]; a width of 1 is a plain list. Booleans and strings are refused, though NumPy accepts them."""
        rows = self._value(key)
        if type(rows) is not list or len(rows) != self._count:
            what = f"has {len(rows)} rows" if isinstance(rows, list) else "is not a list"
            raise AvatarError(f"{what}, but the .ply has {self._count} Gaussians", file=self._path, field=key)
        if width > 1 and {(type(row), len(row) if type(row) is list else 0) for row in rows} != {
            (list, width)
        }:
            at = next(i for i, row in enumerate(rows) if type(row) is not list or len(row) != width)
            raise AvatarError(f"is not a list of {width} numbers", file=self._path, field=f"{key}[{at}]")
        if not set(map(type, _flat(rows, width))) <= {int, float}:
            at = next(i for i, value in enumerate(_flat(rows, width)) if type(value) not in (int, float))
            raise AvatarError("is not a number", file=self._path, field=f"{key}[{at // width}]")
        try:
            flat = np.fromiter(_flat(rows, width), np.float64, self._count * width)
        except OverflowError:  # an integer of more than 308 digits
            raise AvatarError("holds a number that is too large", file=self._path, field=key) from None
        return flat.reshape(self._count, width)

    def _value(self, key: str) -> Any:
        if key not in self._values:
            raise AvatarError("is missing", file=self._path, field=key)
        return self._values[key]

    def _bytes(self) -> bytes:
        rows = self._count + MIN_ROWS
        data = read_bytes(self._path, MAX_BYTES * rows)
        for mark, most in ((b",", MAX_COMMAS), (b"[", MAX_BRACKETS), (b"{", MAX_BRACKETS)):
            if data.count(mark) > most * rows:
                raise AvatarError(
                    f"has far more lists and numbers than {self._count} Gaussians need", file=self._path
                )
        return data


@dataclass(frozen=True)
class Config:
    """The config.yaml of a run; without a file every value is unset."""

    file: Path | None
    values: Mapping[str, Any]

    def get(self, section: str, key: str, kind: type) -> Any:
        """The value of `section.key`, None if it is unset. Raises AvatarError for a value of another type."""
        holder = self.values.get(section)
        value = holder.get(key) if isinstance(holder, dict) else None
        if value is not None and type(value) is not kind:
            raise AvatarError(
                f"is {str(value)[:40]!a}, expected {kind.__name__}; correct it, or use the option",
                file=self.file,
                field=f"{section}.{key}",
            )
        return value


def read_config(cloud: PointCloud) -> Config:
    """The run's config.yaml, next to the .ply or further up in the run.

    Plain YAML: no tags of Python, no aliases. Raises AvatarError for anything else and for a large file.
    """
    path = cloud.find(CONFIG)
    if path is None:
        return Config(None, {})
    data = read_bytes(path, MAX_CONFIG_BYTES)
    try:
        values = yaml.load(data, _PlainLoader)
    except (
        Exception
    ) as error:  # invalid scalars of standard tags raise almost anything (!!int '', !!timestamp 1-1-1)
        reason = " ".join(str(error).split())[:100]
        raise AvatarError(
            f"is not YAML that can be read ({type(error).__name__}: {reason!a})", file=path
        ) from None
    if not isinstance(values, dict):
        raise AvatarError("has no settings", file=path)
    return Config(path, values)


class _PlainLoader(yaml.SafeLoader):
    """A YAML loader without aliases, since a few hundred bytes of them can expand to gigabytes."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases are not supported; write them out")
        return super().compose_node(parent, index)


def _flat(rows: list[Any], width: int) -> Iterator[Any]:
    nested: Iterable[Any] = rows if width == 1 else chain.from_iterable(rows)
    return iter(nested)


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")
