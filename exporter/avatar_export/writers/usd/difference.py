"""Compares two USD crate files of a folder; `compare` runs it as a separate process, which may crash.

    python -m avatar_export.writers.usd.difference FOLDER

prints one line of JSON at the end, {"difference": PHRASE or null}; without it, a file could not be read.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf

from avatar_export.writers.usd.compare import NEW, OLD
from avatar_export.writers.usd.layer import open_layer, spec_paths

RELATIVE, ABSOLUTE = 1e-6, 1e-9
FREE = ("generator",)  # of customData, which differ between versions of this program
MEMORY = 4 << 30  # bytes of address space, part of which the library takes when it starts
MEMORY_OF_FILE = 64  # times the file's size, since values are copied and widened


def difference(old: Any, new: Any) -> str | None:
    """The first difference between two layers, as one phrase; None without one."""
    old_paths, new_paths = spec_paths(old), spec_paths(new)
    for path in sorted(set(old_paths) ^ set(new_paths)):
        return f"{_shown(path)} is {'missing' if path in set(new_paths) else 'not expected'}"
    for path in new_paths:
        there, ours = old.GetObjectAtPath(path), new.GetObjectAtPath(path)
        if there is None or ours is None:  # a target, which is only a path
            if there is not ours:
                return f"{_shown(path)} is of another kind"
            continue
        if type(there) is not type(ours):
            return f"{_shown(path)} is of another kind"
        keys = set(there.ListInfoKeys()) ^ set(ours.ListInfoKeys())
        if keys:
            return f"{_shown(path)} has its {_shown(min(keys))} on one side only"
        for key in sorted(ours.ListInfoKeys()):
            if not _same(there.GetInfo(key), ours.GetInfo(key)):
                return f"{_shown(path)} has another {_shown(key)}"
        if isinstance(ours, Sdf.PrimSpec) and _children(there) != _children(ours):
            return f"{_shown(path)} has its children in another order"
    return None


def _same(old: Any, new: Any) -> bool:
    if type(old) is not type(new):
        return False
    if isinstance(new, Mapping):
        return old.keys() == new.keys() and all(_same(old[key], new[key]) for key in new if key not in FREE)
    a, b = _numbers(old), _numbers(new)
    if a is None or b is None:
        return bool(old == new)
    return a.shape == b.shape and bool((np.abs(a - b) <= RELATIVE * np.abs(b) + ABSOLUTE).all())


def _numbers(value: Any) -> Any:
    """A value of floats as a float64 array; None for other values, which must be equal."""
    if isinstance(value, Gf.Quatd | Gf.Quatf | Gf.Quath):
        return np.array([value.GetReal(), *value.GetImaginary()], np.float64)
    if isinstance(value, str | int | bool):
        return None
    if not isinstance(value, float) and not type(value).__module__.startswith(("pxr.Gf", "pxr.Vt")):
        return None
    array = np.array(value)
    return array.astype(np.float64) if array.dtype.kind == "f" else None


def _children(prim: Any) -> list[str]:
    return [child.name for child in prim.nameChildren]


def _shown(name: object) -> str:
    return ascii(str(name))[1:-1][:120]


def _limit_memory(size: int) -> None:
    try:
        import resource
    except ImportError:  # not on POSIX systems
        return
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY + MEMORY_OF_FILE * size,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def main(folder: Path) -> None:
    """Print the difference between OLD and NEW in `folder`."""
    old, new = (folder / name for name in (OLD, NEW))
    _limit_memory(old.stat().st_size)
    found = difference(open_layer(old.read_bytes()), open_layer(new.read_bytes()))
    sys.stdout.write("\n" + json.dumps({"difference": found}) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
