"""A small reference that tests modify."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import Case, Reference, encode, make_reference
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar
from tests.hostile import only_avatar_errors

CAMERA = Camera.orbit(np.zeros(3), 0.4, 0.3, 0.1, 0.6, 40, 24)


@cache
def avatar() -> Avatar:
    return full_avatar(2)


@cache
def reference() -> Reference:
    """One posed case of 16 Gaussians, 8 vertices and 64 pixels."""
    case = Case("nod", "für alle", frame_pose(avatar(), avatar().clips[0], 3), CAMERA, (0.5, 0.25, 1.0))
    return make_reference(avatar(), [case], rows=16, pixels=64, generator="made for tests")


def encoded() -> dict[str, bytes]:
    """The files of `reference()`."""
    return dict(encode(reference()))


@dataclass(frozen=True)
class Held:
    """The files of a reference, to be changed and read."""

    files: dict[str, bytes]
    decode: Callable[[Callable[[str, int], bytes]], Any]
    cases: str
    vectors: str

    def read(self, changed: Mapping[str, bytes] | None = None) -> Any:
        """What the files hold, some of them changed."""
        files = self.files | (changed or {})

        def one(name: str, limit: int) -> bytes:
            assert len(files[name]) <= limit
            return files[name]

        return self.decode(one)

    def refused(self, changed: Mapping[str, bytes]) -> str:
        """The one line that changed files are refused with."""
        with pytest.raises(AvatarError) as error:
            self.read(changed)
        line = str(error.value)
        assert "\n" not in line and len(line) < 400
        return line

    def with_cases(self, change: Callable[[Any], object]) -> dict[str, bytes]:
        """Another document of cases."""
        document = json.loads(self.files[self.cases])
        change(document)
        return {self.cases: json.dumps(document).encode()}

    def with_vectors(self, changed: Mapping[str, Any]) -> dict[str, bytes]:
        """Other tensors; None is none."""
        tensors = safetensors.decode(self.files[self.vectors], "x") | changed
        kept = {name: array for name, array in tensors.items() if array is not None}
        return {self.vectors: b"".join(safetensors.encode(kept))}

    def damaged(self, name: str, edits: list[tuple[int, bytes]], *, cut: bool = False) -> None:
        """Bytes written over a file; it is read, or refused with one line."""
        data = self.files[name]
        for at, new in edits:
            at %= len(data) + 1
            data = data[:at] + new + (b"" if cut else data[at + max(len(new), 1) :])
        only_avatar_errors(lambda: self.read({name: data}))
