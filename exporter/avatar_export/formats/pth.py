"""`.pth` files (and metrical-tracker's `.frame`) without torch: a zip of one pickle and raw storages.

The pickle is interpreted by an allow-list; a tensor becomes a StoredArray over its storage's bytes inside the
zip, so that a file of gigabytes opens in milliseconds and is read by rows. The checksums of storages are
therefore not compared.
"""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from avatar_export.formats.archive import ZIP_FAULTS
from avatar_export.formats.npy import RowSource, StoredArray, number_type, stored_array
from avatar_export.formats.pickle.arrays import parse_pickle
from avatar_export.formats.pickle.values import Global, StandIn
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

MAX_PICKLE_BYTES = 256 << 20
LEGACY_MAGIC = b"\x80\x02\x8a\x0al\xfc\x9cF\xf9 j\xa8P\x19."  # first pickle of torch.save before 1.6
STORAGE_CODES = {
    "FloatStorage": "f4",
    "DoubleStorage": "f8",
    "HalfStorage": "f2",
    "LongStorage": "i8",
    "IntStorage": "i4",
    "ShortStorage": "i2",
    "CharStorage": "i1",
    "ByteStorage": "u1",
    "BoolStorage": "b1",
}


def read_checkpoint(path: Path) -> object:
    """The object that torch.save wrote: tuples, lists, dicts, numbers; tensors and arrays as RowSources.

    Tags of devices (cuda:0) are ignored. Raises AvatarError for the format of torch before 1.6, big-endian
    files, compressed storages, names outside the allow-list, and sizes that disagree.
    """
    storages = _Storages(path)
    return parse_pickle(storages.pickle, path, _torch_globals(path), storages.load)


def read_frame(path: Path) -> dict[str, object]:
    """A tracked frame: torch.save of (nested) dicts of NumPy arrays or tensors. Raises as above."""
    frame = read_checkpoint(path)
    if not isinstance(frame, dict):
        raise AvatarError("is not a tracked frame: it does not hold a dict", file=path)
    return frame


class _Storages:
    """The zip's directory: its pickle, and storages by key."""

    def __init__(self, path: Path):
        self.path = path
        self.offsets: dict[str, int] = {}
        try:
            with open_file(path) as stream:
                self._refuse_legacy(stream.read(512))
                with zipfile.ZipFile(stream) as archive:
                    self._list(archive)
                    self.pickle = archive.read(self._pickle_entry())
        except ZIP_FAULTS as error:
            reason = f"{type(error).__name__}: {str(error)[:80]}"
            raise AvatarError(f"is not a zip of torch.save ({reason!a})", file=path) from error

    def _refuse_legacy(self, head: bytes) -> None:
        if head.startswith(LEGACY_MAGIC) or head[257:262] == b"ustar":
            raise AvatarError(
                "is in the format of torch before 1.6; load it once with torch and torch.save it again",
                file=self.path,
            )

    def _list(self, archive: zipfile.ZipFile) -> None:
        self.entries = {entry.filename: entry for entry in archive.infolist()}
        if len(self.entries) != len(archive.infolist()):
            raise AvatarError("has duplicate entries", file=self.path)
        pickles = [name for name in self.entries if name == "data.pkl" or name.endswith("/data.pkl")]
        if len(pickles) != 1:
            raise AvatarError(f"has {len(pickles)} entries data.pkl; torch.save writes one", file=self.path)
        self.prefix = pickles[0].removesuffix("data.pkl")
        order = self.entries.get(f"{self.prefix}byteorder")
        if order and (order.file_size > 16 or archive.read(order) != b"little"):
            raise AvatarError("is big-endian; save it on a little-endian machine", file=self.path)

    def _pickle_entry(self) -> zipfile.ZipInfo:
        entry = self.entries[f"{self.prefix}data.pkl"]
        if entry.file_size > MAX_PICKLE_BYTES or entry.compress_type != zipfile.ZIP_STORED:
            raise AvatarError(f"data.pkl is compressed or over {MAX_PICKLE_BYTES} bytes", file=self.path)
        return entry

    def load(self, reference: object) -> _Storage:
        """The storage of ('storage', its class, key, device, number of elements)."""
        if not isinstance(reference, tuple) or len(reference) != 5 or reference[0] != "storage":
            raise AvatarError("refers to something that is not a storage", file=self.path)
        _, kind, key, _, count = reference
        code = STORAGE_CODES.get(kind.name.removeprefix("torch.")) if isinstance(kind, Global) else None
        dtype = number_type("<" + code) if code else None
        if dtype is None or not isinstance(key, str) or type(count) is not int:
            raise AvatarError("refers to a storage of unknown type", file=self.path)
        name = f"{self.prefix}data/{key}"
        entry = self.entries.get(name)
        if entry is None:
            raise AvatarError("the storage is missing", file=self.path, field=ascii(name)[1:-1])
        if entry.compress_type != zipfile.ZIP_STORED or entry.flag_bits & 1:
            raise AvatarError("the storage is compressed or encrypted", file=self.path, field=name)
        if entry.file_size != count * dtype.itemsize or entry.compress_size != entry.file_size:
            raise AvatarError(
                f"the storage has {entry.file_size} bytes, {count} {code} need {count * dtype.itemsize}",
                file=self.path,
                field=name,
            )
        if name not in self.offsets:
            self.offsets[name] = self._data_offset(entry)
        return _Storage(self.path, name, self.offsets[name], count, dtype)

    def _data_offset(self, entry: zipfile.ZipInfo) -> int:
        """The offset of an entry's bytes: after its local header, whose padding varies."""
        with open_file(self.path) as stream:
            size = stream.seek(0, 2)
            stream.seek(entry.header_offset)
            header = stream.read(30)
            if len(header) != 30 or not header.startswith(b"PK\x03\x04"):
                raise AvatarError("the storage's zip header is damaged", file=self.path, field=entry.filename)
            method, name_length, extra_length = struct.unpack("<8xH16xHH", header)
            name = stream.read(name_length)
        encoding = "utf8" if entry.flag_bits & 0x800 else "cp437"
        offset: int = entry.header_offset + 30 + name_length + extra_length
        if (
            method
            or name.decode(encoding, "replace") != entry.orig_filename
            or offset + entry.file_size > size
        ):
            raise AvatarError("the storage's zip header is damaged", file=self.path, field=entry.filename)
        return offset


class _Storage:
    """A contiguous range of numbers in the file."""

    def __init__(self, path: Path, name: str, offset: int, count: int, dtype: np.dtype[np.generic]):
        self.path, self.name, self.offset, self.count, self.dtype = path, name, offset, count, dtype


class _Tensor(StandIn):
    """A view of a storage, checked where it is made."""

    def __init__(self, array: StoredArray):
        self.array = array

    def finish(self, name: str) -> RowSource:
        a = self.array
        return StoredArray(name, a.shape, a.dtype, a.strides, a.offset, a.source, a.file)


def _torch_globals(path: Path) -> dict[str, Global]:
    def tensor(storage: object, first: object, shape: object, strides: object, *_: object) -> _Tensor:
        if not isinstance(storage, _Storage) or type(first) is not int or not 0 <= first <= storage.count:
            raise ValueError("a tensor lies outside its storage")
        if not isinstance(shape, tuple) or not isinstance(strides, tuple):
            raise ValueError("a tensor has no shape or strides")
        item = storage.dtype.itemsize
        return _Tensor(
            stored_array(
                storage.name, storage.path, storage.path, shape=shape, strides=strides, dtype=storage.dtype,
                offset=storage.offset + first * item, available=(storage.count - first) * item,
            )
        )  # fmt: skip

    def parameter(data: object, *_: object) -> object:
        if not isinstance(data, _Tensor):
            raise ValueError("a parameter is not a tensor")
        return data

    def size(items: object = ()) -> object:
        if not isinstance(items, tuple):
            raise ValueError("a torch.Size is not a tuple")
        return items

    makers: dict[str, Callable[..., object]] = {
        "torch._utils._rebuild_tensor_v2": tensor,
        "torch._utils._rebuild_parameter": parameter,
        "torch.Size": size,
    }
    names = {name: Global(name, make) for name, make in makers.items()}
    return names | {f"torch.{kind}": Global(f"torch.{kind}", _not_called) for kind in STORAGE_CODES}


def _not_called(*arguments: object) -> object:
    raise ValueError("a storage class is called")
