"""The conformance avatars as bundles, for a port to run: `python -m tests.conformance.bundles OUT`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.reference import reference_facts, reference_files
from tests import bundles
from tests.conformance.avatars import AVATARS
from tests.conformance.references import committed


def write_bundles(out: Path, names: Iterable[str] = tuple(AVATARS)) -> None:
    """A bundle `out`/NAME of each avatar, with its committed reference as the bundle's own."""
    for name in names:
        folder = out / name
        avatar = replace(AVATARS[name](), enhancer=None)  # which no stage goes through
        write_bundle(avatar, folder, preview=False, reference=False)
        document = bundles.manifest(folder)
        normative = {entry["path"]: entry["sha256"] for entry in document["files"] if not entry["derived"]}
        reference = replace(committed(name), files=normative)
        (folder / "reference").mkdir()
        for path, data in reference_files(reference, avatar).items():
            (folder / path).write_bytes(data)
            document["files"].append({"path": path, "bytes": 0, "sha256": "0" * 64, "derived": True})
        document["reference"] = reference_facts(reference)
        (folder / "avatar.json").write_text(json.dumps(document, indent=1, ensure_ascii=False), "utf-8")
        bundles.sign(folder)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m tests.conformance.bundles OUT")
    write_bundles(Path(sys.argv[1]))
