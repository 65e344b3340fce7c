"""An independent weights-only reader of torch checkpoints, for tests: an allow-list and raw storages."""

from __future__ import annotations

import collections
import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

STORAGE = {"FloatStorage": np.dtype("<f4"), "LongStorage": np.dtype("<i8")}


class WeightsOnly(pickle.Unpickler):
    """Knows torch's two rebuilding functions, its storage names and OrderedDict; nothing else."""

    def __init__(self, zip_: zipfile.ZipFile):
        self.zip = zip_
        self.stem = zip_.namelist()[0].split("/")[0]
        super().__init__(io.BytesIO(zip_.read(f"{self.stem}/data.pkl")))

    def find_class(self, module: str, name: str) -> Any:
        allowed = {
            ("torch._utils", "_rebuild_tensor_v2"): self.tensor,
            ("torch._utils", "_rebuild_parameter"): lambda data, grad, hooks: data,
            ("collections", "OrderedDict"): collections.OrderedDict,
            ("torch", "FloatStorage"): "FloatStorage",
            ("torch", "LongStorage"): "LongStorage",
        }
        return allowed[module, name]

    def persistent_load(self, pid: Any) -> np.ndarray:
        kind, storage, key, device, elements = pid
        assert (kind, device) == ("storage", "cuda:0")
        data = np.frombuffer(self.zip.read(f"{self.stem}/data/{key}"), STORAGE[storage])
        assert len(data) == elements
        return data

    @staticmethod
    def tensor(
        storage: np.ndarray, offset: int, size: Any, stride: Any, grad: bool, hooks: Any
    ) -> np.ndarray:
        assert offset == 0 and not grad
        contiguous = tuple(int(np.prod(size[i + 1 :])) for i in range(len(size)))
        assert tuple(stride) == contiguous
        return storage.reshape(size)


def load_checkpoint(path: Path) -> Any:
    with zipfile.ZipFile(path) as zip_:
        assert zip_.testzip() is None
        return WeightsOnly(zip_).load()
