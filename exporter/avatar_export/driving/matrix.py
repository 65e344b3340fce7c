"""Reads a driving matrix: JSON from the ARKit names to an avatar's own expressions, eyelids and joints.

{"inputs": [ARKit names, any spelling], "outputs": ["expression/NAME", "eyelid/NAME", "joint/NAME/x|y|z"],
"matrix": [[one number per input] per output]}. Joint outputs are rotation vectors in radians, mesh axes.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.formats.json_text import parse_json
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.codec.glb import short
from avatar_runtime.driving.arkit import ARKIT_NAMES, canonical
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.io.whole_files import read_bytes

MAX_FILE_BYTES = 16 << 20
# No face needs a larger factor.
MAX_FACTOR = 1e6


def with_driving(avatar: Avatar, path: Path | str) -> Avatar:
    """`avatar` driven by the matrix in the JSON file `path`; its head and eye joints do not change.

    Raises AvatarError for a file that is not such a matrix, and for outputs that the avatar lacks.
    """
    source = Path(path).name
    document = _document(read_bytes(Path(path), MAX_FILE_BYTES), source)
    inputs = _inputs(_names(document, "inputs", source), source)
    outputs = _outputs(_names(document, "outputs", source), avatar, source)
    matrix = _matrix(document["matrix"], len(outputs), len(inputs), source)
    return replace(
        avatar, driving=replace(avatar.driving, mode="matrix", inputs=inputs, outputs=outputs, matrix=matrix)
    )


def _document(data: bytes, source: str) -> dict[str, Any]:
    document = parse_json(data, source)
    keys = ("inputs", "outputs", "matrix")
    if not isinstance(document, dict) or any(not isinstance(document.get(key), list) for key in keys):
        raise AvatarError(f"needs an object with the lists {', '.join(keys)}", file=source)
    return document


def _names(document: dict[str, Any], key: str, source: str) -> list[str]:
    names: list[Any] = document[key]
    for at, name in enumerate(names):
        if not isinstance(name, str):
            raise AvatarError(f"{short(name)} is not a name", file=source, field=f"{key}[{at}]")
    if not names:
        raise AvatarError("is empty", file=source, field=key)
    return names


def _inputs(names: list[str], source: str) -> tuple[str, ...]:
    found = []
    for at, name in enumerate(names):
        known = canonical(name)
        if known is None:
            raise no_such("ARKit name", name, ARKIT_NAMES, file=source, field=f"inputs[{at}]")
        found.append(known)
    return _distinct(found, "inputs", source)


def _outputs(names: list[str], avatar: Avatar, source: str) -> tuple[str, ...]:
    """Output names with expression aliases resolved."""
    known = {f"expression/{alias}": f"expression/{e.name}" for e in avatar.expressions for alias in e.aliases}
    own = [f"expression/{name}" for name in avatar.expression_names]
    own += [f"eyelid/{name}" for name in avatar.eyelids]
    joints = avatar.rig.joint_names if avatar.rig else ()
    own += [f"joint/{name}/{axis}" for name in joints for axis in "xyz"]
    known |= {name: name for name in own}
    for at, name in enumerate(names):
        if name not in known:
            raise no_such("driving output of this avatar", name, known, file=source, field=f"outputs[{at}]")
    return _distinct([known[name] for name in names], "outputs", source)


def _distinct(names: list[str], key: str, source: str) -> tuple[str, ...]:
    seen: dict[str, int] = {}
    for at, name in enumerate(names):
        if name in seen:
            raise AvatarError(f"entries {seen[name]} and {at} are both {name}", file=source, field=key)
        seen[name] = at
    return tuple(names)


def _matrix(rows: list[Any], outputs: int, inputs: int, source: str) -> F32:
    if len(rows) != outputs:
        raise AvatarError(f"has {len(rows)} rows for {outputs} outputs", file=source, field="matrix")
    for at, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != inputs:
            size = len(row) if isinstance(row, list) else "no"
            raise AvatarError(f"has {size} numbers for {inputs} inputs", file=source, field=f"matrix[{at}]")
        for column, value in enumerate(row):
            if not _is_factor(value):
                raise AvatarError(
                    f"{short(value)} is not a finite factor", file=source, field=f"matrix[{at}][{column}]"
                )
    return np.array(rows, np.float32)


def _is_factor(value: object) -> bool:
    # A comparison works for integers of any size, a conversion does not; NaN compares false.
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= MAX_FACTOR
