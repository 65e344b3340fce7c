"""enhancer.onnx and enhancer.json beside a checkpoint: a network for its images, and the network's measured quality.

enhancer.json holds the entry `enhancer` of avatar.json (SPEC.md section 17) and nothing else. The trainer of this
project writes both files; other programs may write them too.
"""

from __future__ import annotations

import json
from pathlib import Path

from avatar_export.formats.json_text import parse_json
from avatar_runtime.avatar import Enhancer
from avatar_runtime.checks.enhancer import LARGEST, check_enhancer
from avatar_runtime.codec.manifest import ENHANCER_FILE, decode_enhancer, encode_enhancer
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_schema.validate import key_problems

FACTS_FILE = "enhancer.json"
MAX_BYTES = 1 << 16


def save_enhancer(folder: Path, enhancer: Enhancer) -> None:
    """Write both files into the existing `folder`."""
    (folder / ENHANCER_FILE).write_bytes(enhancer.onnx)
    text = json.dumps(encode_enhancer(enhancer), indent=1, ensure_ascii=False, allow_nan=False)
    (folder / FACTS_FILE).write_text(text + "\n", "utf-8")


def read_enhancer(folder: Path) -> Enhancer | None:
    """The enhancer in a checkpoint's folder; None without either file.

    The network itself is not checked here. Raises AvatarError for one file without the other, files that are too large,
    and facts that are missing or invalid.
    """
    onnx, facts = folder / ENHANCER_FILE, folder / FACTS_FILE
    if not onnx.exists() and not facts.exists():
        return None
    for path, other in ((onnx, facts), (facts, onnx)):
        if not path.exists():
            raise AvatarError(f"is missing beside {other.name}", file=path)
    said = parse_json(read_bytes(facts, MAX_BYTES), facts)
    for problem in key_problems(said, "enhancer"):
        raise AvatarError(problem.message, file=facts, field=problem.path)
    data = read_bytes(onnx, LARGEST)
    try:
        return check_enhancer(decode_enhancer(said, data))
    except AvatarError as error:
        raise AvatarError(error.message, file=facts, field=error.field) from None
