"""The conformance avatars as bundles are sound and play."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_export.checks.bundle import validate
from tests.commands import Run
from tests.conformance.bundles import write_bundles


@pytest.mark.parametrize("name", ["skin_polar", "surface_fine", "lit_head"])
def test_a_conformance_avatar_as_a_bundle(run: Run, tmp_path: Path, name: str) -> None:
    write_bundles(tmp_path, [name])
    code, text, error = run("conform", tmp_path / name, "--backend", "reference")
    assert code == 0, text + error
    assert list((tmp_path / name / "reference").glob("*.engine.png"))
    assert [problem for problem in validate(tmp_path / name) if not problem.warning] == []
