"""Scans that are made of ICT's identity shapes, and the take of expressions in turn."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from samples.asm.data import TOPOLOGIES, load_asm_head, main

from avatar_export.asm.files import load


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_a_template_is_written_as_a_face(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "template.npz"
    monkeypatch.setattr(sys, "argv", ["asm_data", name, "-o", str(out), "--components", "3"])
    main()
    face = load(out)
    assert face.binding.components == 3 and len(face.template.bone_names) == 84
    np.testing.assert_array_equal(face.template.vertices, load_asm_head(name).template.vertices)
