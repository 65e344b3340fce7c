"""The scene for people runs without complaint, and shows the head."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tools.godot.demo import shots, write_project

pytestmark = pytest.mark.godot


def test_the_scene_shows_the_head(tmp_path: Path) -> None:
    """Take it out, and much of the picture changes."""
    write_project(tmp_path)
    scene = tmp_path / "demo.tscn"
    head = '[node name="Head" parent="." instance=ExtResource("head")]\n'
    images = []
    for hidden in ("", "visible = false\n"):
        assert head in scene.read_text("utf-8")
        scene.write_text(scene.read_text("utf-8").replace(head, head + hidden), "utf-8")
        images.append([np.asarray(image, float) for image in shots(tmp_path, tmp_path, 3)])
    shown, empty = (each[-1] for each in images)
    changed = (np.abs(shown - empty).max(axis=2) > 20).mean()
    assert len(images[0]) == 3 and 0.04 < changed < 0.2
