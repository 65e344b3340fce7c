"""The sound inputs that misfits are made of."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.exporter.fit.misfits import Bases


@pytest.fixture(scope="session")
def bases(
    sample_blendshapes: Path, sample_splatting_head_sh3: Path, sample_body: Path, sample_lam: Path
) -> Bases:
    """The conformance samples."""
    return Bases(sample_blendshapes, sample_splatting_head_sh3, sample_body, sample_lam)
