"""The engine starts here, and a fresh project with the add-on is imported, played and exported without complaint."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.bundle import load
from tests.players.godot import engine

pytestmark = pytest.mark.godot
HEAD = engine.REPOSITORY / "samples" / "trained" / "head_blendshapes"

SAYS = """extends SceneTree
func _initialize() -> void:
	print("adapter ", RenderingServer.get_video_adapter_name(), ", ", RenderingServer.get_current_rendering_method())
	print("device ", RenderingServer.get_rendering_device() != null)
	quit(3)
"""


@pytest.mark.parametrize("renderer", engine.RENDERERS)
def test_the_engine_draws_on_a_software_vulkan(tmp_path: Path, renderer: str) -> None:
    folder = engine.project(tmp_path, renderer, add_on=False)
    (folder / "says.gd").write_text(SAYS)
    said = engine.run(folder, "--script", "res://says.gd")
    print(said.text)
    assert said.code == 3 and not said.complaints and not said.leaked, said.text
    assert f", {renderer}\n" in said.text and "device true" in said.text
    assert "Vulkan" in said.text, "it fell back to OpenGL"


def test_without_a_display_there_is_no_device(tmp_path: Path) -> None:
    folder = engine.project(tmp_path, add_on=False)
    (folder / "says.gd").write_text(SAYS)
    said = engine.run(folder, "--script", "res://says.gd", headless=True)
    assert said.code == 3 and "device false" in said.text and not said.complaints, said.text


def test_complaints_and_leaks_are_seen(tmp_path: Path) -> None:
    folder = engine.project(tmp_path, add_on=False)
    (folder / "says.gd").write_text(
        "extends SceneTree\nfunc _initialize() -> void:\n\tNode.new()\n\tpush_error('one')\n\tquit()\n"
    )
    said = engine.run(folder, "--script", "res://says.gd", headless=True)
    assert said.leaked and said.complaints[0] == "ERROR: one", said.text


def test_the_first_import_of_a_fresh_project_ends_well(tmp_path: Path) -> None:
    """The engine crashes at the end of one that meets an extension with a class that it documents: ours are not."""
    folder = engine.project(tmp_path)
    engine.imported(folder).clean()
    listed = (folder / ".godot" / "extension_list.cfg").read_text()
    assert listed.split() == [f"res://{engine.FOLDER}/gaussian_avatar.gdextension"]
    engine.imported(folder).clean()


GAME = """extends Node3D
func _ready() -> void:
	var head: GaussianAvatar3D = $Head
	print("error '", head.error, "', a game: ", OS.has_feature("template"))
	head.set_expression(head.names[0], 1.0)
	for frame: int in 3:
		await RenderingServer.frame_post_draw
	get_viewport().get_texture().get_image().save_png(OS.get_cmdline_user_args()[0])
	get_tree().quit()
"""
SCENE = """[gd_scene format=3]
[ext_resource type="Script" path="res://game.gd" id="1"]
[ext_resource type="PackedScene" path="res://head.avatar" id="2"]
[node name="Game" type="Node3D"]
script = ExtResource("1")
[node name="Head" parent="." instance=ExtResource("2")]
[node name="Camera" type="Camera3D" parent="."]
transform = Transform3D(1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1)
"""


def test_an_exported_game_shows_what_the_project_shows(tmp_path: Path) -> None:
    settings = '[application]\nrun/main_scene="res://game.tscn"\n[display]\nwindow/size/viewport_width=256\n'
    folder = engine.project(tmp_path / "game", settings=settings)
    (folder / "head.avatar").write_bytes(pack([load(HEAD)], Fineness()).file)
    (folder / "game.gd").write_text(GAME)
    (folder / "game.tscn").write_text(SCENE)
    engine.imported(folder).clean()
    game = engine.exported(folder, tmp_path / "out")
    for renderer in engine.RENDERERS:
        chosen = ("--rendering-method", renderer, "--")
        in_game = game(*chosen, str(tmp_path / "game.png")).clean()
        in_project = engine.run(folder, *chosen, str(tmp_path / "project.png")).clean()
        assert "error '', a game: true" in in_game.text and "error '', a game: false" in in_project.text
        shown, expected = (np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("game", "project"))
        np.testing.assert_array_equal(shown, expected)
        assert len(np.unique(shown.reshape(-1, shown.shape[-1]), axis=0)) > 1000, "there is no head"
