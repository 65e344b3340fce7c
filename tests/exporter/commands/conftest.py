"""A bundle with a reference, and a copy of it for a test to damage."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from avatar_export.writers.bundle import write_bundle
from tests import bundles
from tests.avatars import full_avatar


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("conform") / "good"
    write_bundle(full_avatar(), out, preview=False, engine_files=False)
    return out


@pytest.fixture
def bundle(good: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(good, tmp_path / "bundle"))


VECTORS, CASES = "reference/vectors.safetensors", "reference/cases.json"


def edit_vectors(bundle: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    tensors = {name: t.copy() for name, t in load_tensors((bundle / VECTORS).read_bytes()).items()}
    change(tensors)
    (bundle / VECTORS).write_bytes(save_tensors(tensors))
    bundles.sign(bundle)


def edit_cases(bundle: Path, change: Callable[[dict[str, Any]], Any]) -> None:
    document = json.loads((bundle / CASES).read_text("utf-8"))
    change(document)
    (bundle / CASES).write_text(json.dumps(document), "utf-8")
    bundles.sign(bundle)
