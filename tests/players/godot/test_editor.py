"""The add-on in the editor: the picture as icon, a scene that moves at once, reimports, the menu item."""

from __future__ import annotations

import shutil
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

from avatar_export.packing.reference import reference_folder, reference_of, write_folder
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import driving_facts, prepare, write
from tests.avatars import full_avatar
from tests.players.core_cases import packed
from tests.players.godot import engine
from tests.players.godot.test_scripts import HERE, result

pytestmark = pytest.mark.godot

SCENE = """[gd_scene format=3]
[ext_resource type="PackedScene" path="res://head.avatar" id="1"]
[node name="Top" type="Node3D"]
[node name="Box" type="Node3D" parent="."]
[node name="head" parent="." instance=ExtResource("1")]
"""
PLAYED = SCENE.replace(
    '[node name="Top"', '[ext_resource type="Script" path="res://played.gd" id="2"]\n[node name="Top"'
).replace('type="Node3D"]\n', 'type="Node3D"]\nscript = ExtResource("2")\n', 1)
PLUGIN = '[plugin]\nname="Probe"\ndescription=""\nauthor=""\nversion=""\nscript="editor.gd"\n'


def picture() -> bytes:
    """A WebP, twice as high as wide."""
    held = BytesIO()
    Image.new("RGB", (200, 400), "red").save(held, "webp")
    return held.getvalue()


def test_the_editor(tmp_path: Path) -> None:
    folder, files = engine.project(tmp_path / "project"), tmp_path / "files"
    files.mkdir()
    made = write(prepare([full_avatar(5)], Fineness(4.0)), driving_facts(full_avatar(5)), picture())
    (files / "head.avatar").write_bytes(made.file)
    (files / "new.avatar").write_bytes(packed(replace(full_avatar(6), name="New")))
    (files / "cut.avatar").write_bytes(made.file[:900])
    reference = reference_folder(files / "head.avatar")
    write_folder(reference, reference_of(made.avatar, "right", made.file), force=False)
    shutil.copy(files / "head.avatar", folder)
    (folder / "user.tscn").write_text(SCENE)
    (folder / "played.tscn").write_text(PLAYED)
    shutil.copy(HERE / "played.gd", folder)
    given = [files / "new.avatar", files / "cut.avatar", files / "head.avatar", reference]
    (folder / "given.txt").write_text("\n".join(map(str, given)))
    engine.imported(folder).clean()
    probe = folder / "addons" / "probe"
    probe.mkdir()
    (probe / "plugin.cfg").write_text(PLUGIN)
    shutil.copy(HERE / "editor.gd", probe)
    settings = folder / "project.godot"
    settings.write_text(
        settings.read_text().replace('plugin.cfg")', 'plugin.cfg", "res://addons/probe/plugin.cfg")')
    )
    said = engine.run_by_itself(folder, "--editor", "--resolution", "480x320")
    told = result(said, complaints=True)
    drawn_while_still, draws_at_once = told["drawn"]
    assert drawn_while_still < 3 and draws_at_once  # of ten frames of the editor
    assert told["clickable"] == 1
    assert told["played"] == {"ran": True, "stopped": True}
    assert (folder / "played.txt").read_text() == "drawn"  # by the game
    assert told["icon"] == "(32, 64)"  # of 64 pixels
    scene = (folder / "user.tscn").read_text().split('name="head"')[1].splitlines()[1:]
    assert scene == [
        "expressions/jaw/jawOpen = 0.5",
        "joints/jaw/rotation = Quaternion(0, 0.24740396, 0, 0.9689124)",
    ]
    kept = {"jaw": 0.5, "turned": True, "box": True}
    assert told["new"] == {"name": "New", **kept} and told["sound"] == {"name": full_avatar(5).name, **kept}
    assert told["hostile"] == {"name": "New", **kept}  # what was shown stays
    assert "SCRIPT ERROR" not in said.text and not said.leaked
    assert sum("head.avatar: is damaged" in line for line in said.complaints) == 1
    assert "outputs agree" in said.text and "DIFFERS" not in said.text
