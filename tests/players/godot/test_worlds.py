"""Our effect and a user's Compositors: each frame calls all of them, whenever they were set; nothing leaks."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from tests.avatars import full_avatar
from tests.players.core_cases import packed
from tests.players.godot import engine
from tests.players.godot.test_scripts import HERE, result

pytestmark = pytest.mark.godot

# After each change: calls of ours, and of each effect of the user's so far, in a frame.
WANTED = {
    "alone": [1, []],
    "world": [1, [1]],
    "world_and_camera": [1, [0, 1]],  # Godot's rule: a camera's Compositor replaces the world's
    "list_changed": [1, [0, 0, 1, 1]],
    "same_list_again": [1, [0, 0, 1, 1]],
    "camera_gone": [1, [1, 0, 0, 0]],
    "other_camera": [1, [0, 0, 0, 0, 1]],
    "first_camera": [1, [1, 0, 0, 0, 0]],
    "world_gone": [1, [0, 0, 0, 0, 0]],
    "world_again": [1, [0, 0, 0, 0, 0, 1]],
    "node_gone": [1, [0, 0, 0, 0, 0, 0]],
    "node_again": [1, [0, 0, 0, 0, 0, 0, 1]],
    "avatar_gone": [0, [0, 0, 0, 0, 0, 0, 1]],
    "avatar_again": [1, [0, 0, 0, 0, 0, 0, 1]],
    "four_views": [4, [0, 0, 0, 0, 0, 0, 0]],
}


def test_no_compositor_is_lost(tmp_path: Path) -> None:
    folder = engine.project(tmp_path / "worlds")
    for script in ("worlds.gd", "counting.gd"):
        shutil.copy(HERE / script, folder)
    (folder / "right.avatar").write_bytes(packed(full_avatar(5)))
    engine.imported(folder).clean()
    said = engine.run(folder, "--resolution", "64x64", "--script", "res://worlds.gd")
    told: dict[str, Any] = result(said)
    assert {what: told[what] for what in WANTED} == WANTED
    assert told["own_world"] == [1, 1] and told["two_effects"] and told["one_effect"]
    first, second = told["shared"]
    assert 0 < second < 0.9 * first, told["shared"]
    assert told["shown"] == ""
