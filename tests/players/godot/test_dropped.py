"""What `drop` and `make dist` give the engine is taken by it: the add-on comes up, and the pack is an asset."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest

from avatar_export.players.assemble import assemble
from tests.commands import Run
from tests.exporter.serving.packs import packed
from tests.players.godot import engine
from tools import archives

pytestmark = pytest.mark.godot
SAYS = """extends SceneTree
func _initialize() -> void:
	var node: Node3D = (load("res://avatars/head.avatar") as PackedScene).instantiate()
	print("node ", node.get_script().get_global_name(), " ", Engine.has_singleton(&"GaussianAvatarMaker"))
	node.free()
	quit()
"""


@pytest.mark.parametrize("way", ["drop", "archive"])
def test_the_engine_takes_what_is_put_together(built_godot: None, run: Run, tmp_path: Path, way: str) -> None:
    project = engine.project(tmp_path / "game", add_on=False, settings=engine.SWITCHED_ON)
    (project / "says.gd").write_text(SAYS)
    pack = tmp_path / "head.avatar"
    pack.write_bytes(packed())
    if way == "drop":
        assert run("drop", pack, "--into", project)[0] == 0
    else:
        made = archives.ARCHIVES["godot"][2](assemble("godot"))
        zipfile.ZipFile(io.BytesIO(made)).extractall(project)
        (project / "avatars").mkdir()
        pack.rename(project / "avatars/head.avatar")
    engine.imported(project).clean()
    said = engine.run(project, "--script", "res://says.gd", headless=True).clean()
    assert "node GaussianAvatar3D true" in said.text
