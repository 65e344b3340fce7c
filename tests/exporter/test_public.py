"""The public face of avatar_export, as a user types it into an interpreter."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import avatar_export
from avatar_export import AvatarError, ConvertOptions, ReadOptions, convert, read, validate
from avatar_runtime.bundle import load

MODULES = {"cli", "images", "provenance"}  # for packages that build on this one


def test_every_public_name_is_there() -> None:
    for name in avatar_export.__all__:
        assert name in MODULES or getattr(avatar_export, name) is not None
    assert f"avatar-export {avatar_export.__version__}" == avatar_export.GENERATOR
    with pytest.raises(AttributeError, match="has no attribute 'reed'"):
        avatar_export.reed()


def test_a_user_reads_converts_and_validates(sample_splatting_head: Path, tmp_path: Path) -> None:
    source, body = sample_splatting_head / "run", sample_splatting_head / "body" / "body_model.npz"
    avatar = read(source, ReadOptions(no_rig=True))
    assert avatar.provenance["system"] == "splatting_avatar" and avatar.rig is None
    out = tmp_path / "head.avatar.zip"
    plain = ConvertOptions(engine_files=False, reference=False, preview=False)
    made = convert(str(source), out, replace(plain, body_model=body, name="Ada", license="CC0-1.0"))
    assert [problem for problem in validate(out) if not problem.warning] == []
    again = load(out)
    assert made.manifest["provenance"] == again.provenance
    assert {"settings", "files"} <= {note.kind for note in made.notes}
    assert (again.name, again.provenance["licence"]) == ("Ada", "CC0-1.0")
    assert again.rig is not None
    with pytest.raises(AvatarError, match="exists; pass --force to replace it"):
        convert(source, out)


NONE: Any = None
HEAD: Any = "head"
MISTAKES: tuple[tuple[Callable[[], object], type[Exception], str], ...] = (
    (lambda: convert(NONE, HEAD), TypeError, "source is None; a path is needed"),
    (lambda: convert(HEAD, HEAD, options={"no_rig": True}), TypeError, "options is a dict; a ConvertOptions"),
    (lambda: ReadOptions(body_scale=0), ValueError, "body_scale is 0; 1e-06 to 1e+06"),
    (lambda: ConvertOptions(influences=5), ValueError, "influences: '5' is not one of 4, 8"),
    (lambda: read(NONE), TypeError, "path is None; a path is needed"),
    (lambda: ReadOptions(body_scale=math.nan), ValueError, "body_scale is nan; a finite number is needed"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("call", "kind", "message"), MISTAKES, ids=[message[:40] for _, _, message in MISTAKES]
)
def test_a_mistake_names_the_argument(
    call: Callable[[], object], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match="^" + re.escape(message)):
        call()


def test_bad_data_and_bad_calls(tmp_path: Path, sample_splatting_head: Path) -> None:
    with pytest.raises(AvatarError, match="no such file or folder"):
        read(str(tmp_path / "absent"))
    with pytest.raises(AvatarError, match="unknown system 'splatting'"):
        read(sample_splatting_head / "run", system="splatting")
    with pytest.raises(ValueError, match="'up' is not one of right, left"):
        ConvertOptions(handedness="up")


def test_importing_the_package_is_light() -> None:
    program = (
        "import sys, avatar_export;"
        "before = {m.partition('.')[0] for m in sys.modules};"
        "from avatar_export import READERS, AvatarError, ConvertOptions, ReadOptions, convert, read, validate;"
        "after = {m.partition('.')[0] for m in sys.modules};"
        "print('numpy' in before, sorted(after & {'pxr', 'torch', 'numba', 'typer', 'moderngl', 'ufbx'}))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split(maxsplit=1) == ["False", "[]\n"]
