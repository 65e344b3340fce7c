"""The Khronos glTF validator on rig.glb and splats.glb: no error, no warning, and only notes that are known."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.splats_glb import splats_glb
from avatar_runtime.avatar import Avatar
from tests.avatars import full_avatar
from tests.interop.clients import ask

ERROR, WARNING, INFORMATION, HINT = range(4)

# (severity, code, pointer): the validator does not know KHR_gaussian_splatting (its issue 252).
KNOWN = (
    (ERROR, "MESH_PRIMITIVE_INVALID_ATTRIBUTE", r"/attributes/KHR_gaussian_splatting:[A-Z0-9_]+$"),
    (INFORMATION, "UNSUPPORTED_EXTENSION", r"^/extensionsUsed/0$"),
    (INFORMATION, "UNUSED_OBJECT", r"/attributes/TEXCOORD_0$"),  # the vertex ids; there is no texture
)


def unknown(report: dict[str, Any]) -> list[dict[str, Any]]:
    """The issues of a report that are not in KNOWN."""
    return [
        issue
        for issue in report["issues"]["messages"]
        if not any(
            (issue["severity"], issue["code"]) == (severity, code) and re.search(pointer, issue["pointer"])
            for severity, code, pointer in KNOWN
        )
    ]


@pytest.fixture(scope="module")
def reports(
    avatars: Mapping[str, Avatar], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, dict[str, Any]]:
    """File name -> report."""
    folder = tmp_path_factory.mktemp("validator")
    files: dict[str, Path] = {}
    for name, avatar in avatars.items():
        pieces = {
            f"{name}_rig_4": rig_glb(avatar, 4),
            f"{name}_rig_8": rig_glb(avatar, 8),
            f"{name}_splats": splats_glb(avatar),
        }
        for file, data in pieces.items():
            assert data is not None
            files[file] = folder / f"{file}.glb"
            files[file].write_bytes(b"".join(data))
    answer = ask("validate", files=[str(path) for path in files.values()])
    assert answer.facts["version"] == "2.0.0-dev.3.10"
    return dict(zip(files, answer.facts["reports"], strict=True))


def test_no_issue_but_the_known_ones(reports: dict[str, dict[str, Any]]) -> None:
    found = {name: unknown(report) for name, report in reports.items()}
    assert not {name: issues for name, issues in found.items() if issues}
    assert not any(report["issues"]["truncated"] for report in reports.values())


def test_rigs_have_no_error_at_all(reports: dict[str, dict[str, Any]]) -> None:
    counts = {name: report["issues"]["numErrors"] for name, report in reports.items() if "_rig_" in name}
    assert counts and not any(counts.values())


def test_a_fault_is_found(tmp_path: Path) -> None:
    """Weights that no longer add up to 1."""
    pieces = rig_glb(full_avatar())
    assert pieces is not None
    data = b"".join(pieces)
    at = data.index(b"\x00\x00\x80\x3f\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00")  # 1 0 0 0
    (tmp_path / "rig.glb").write_bytes(data[:at] + b"\x00\x00\x00\x3f" + data[at + 4 :])
    answer = ask("validate", files=[str(tmp_path / "rig.glb")])
    assert unknown(answer.facts["reports"][0])
