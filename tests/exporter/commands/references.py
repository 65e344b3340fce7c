"""Changes to the reference of a bundle, signed again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

from tests import bundles

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
