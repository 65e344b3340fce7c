"""What the artist's guide says of the jaw: measured on rig.glb of the head of `make demo`, by glTF's formulas alone.

The script for Blender is run where Blender is installed.
"""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from avatar_export.writers.rig_glb import rig_glb
from tests.avatars import full_avatar
from tests.commands import Run
from tests.interop.clients import blender_program
from tests.oracles.gltf_pose import File, State

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "artist" / "jaw.md"
NEAR_MOUTH, DEEP = 0.006, 0.045  # metres from the middle, and behind the tip of the nose
UPPER, LOWER = 0.25, 0.75  # weights of the jaw


def lips(file: File) -> tuple[int, int]:
    """Vertices of the upper and the lower lip that are closest at rest, by the jaw's skin weights."""
    names = [file.json["nodes"][node]["name"] for node in file.json["skins"][0]["joints"]]
    joints, weights = file.attribute("JOINTS_0"), file.attribute("WEIGHTS_0")
    jaw, rest = (weights * (joints == names.index("jaw"))).sum(axis=1), file.posed(State())
    front = (np.abs(rest[:, 0]) < NEAR_MOUTH) & (rest[:, 2] > rest[:, 2].max() - DEEP)
    upper, lower = np.nonzero(front & (jaw < UPPER))[0], np.nonzero(front & (jaw > LOWER))[0]
    apart = np.linalg.norm(rest[upper][:, None] - rest[lower][None], axis=2)
    row, column = np.unravel_index(apart.argmin(), apart.shape)
    return int(upper[row]), int(lower[column])


@pytest.mark.more
def test_what_the_page_says_of_the_jaw(run: Run, tmp_path: Path) -> None:
    bundle, posed = tmp_path / "head", tmp_path / "pose.json"
    sample = ROOT / "samples" / "trained" / "head_blendshapes"
    assert run("convert", sample, "-o", bundle, "--no-preview", "--no-reference")[0] == 0
    assert run("pose", bundle, "-o", posed, "-a", "jawOpen=1")[0] == 0
    document = json.loads(posed.read_text("utf-8"))
    x, _, _, w = document["nodes"]["jaw"]["rotation_xyzw"]
    turned = {"jaw": document["nodes"]["jaw"]["rotation_xyzw"]}
    whole = State(rotation=turned, weights=document["weights"])
    states = (State(weights={"jawOpen": 1.0}), State(rotation=turned), whole)

    file = File((bundle / "rig.glb").read_bytes())
    upper, lower = lips(file)
    rest, rows = file.posed(State()), []
    for state in states:
        points = file.posed(state)
        gap = 1000 * float(np.linalg.norm(points[upper] - points[lower]))
        moved = 1000 * float(np.linalg.norm(points - rest, axis=1).max())
        print(f"lips part by {gap:.1f} mm, skin moves by {moved:.1f} mm")
        rows.append((round(gap), round(moved)))
    text = PAGE.read_text("utf-8")
    assert [(int(a), int(b)) for a, b in re.findall(r"\| (\d+) mm \| (\d+) mm", text)] == rows
    assert f"{np.degrees(2 * np.arctan2(x, w)):.1f} degrees" in text
    assert rows[0][0] < 5 < 15 < rows[0][1] and rows[2][0] > 40


IMPORT = 'import bpy\nbpy.ops.wm.read_factory_settings(use_empty=True)\nbpy.ops.import_scene.gltf(filepath="rig.glb")\n'
ASK = """
import json
key = bpy.data.objects["avatar"].data.shape_keys.key_blocks["corrective_jaw_00"]
key.value = -1.5
ranges = {(key.slider_min, key.slider_max) for key in bpy.data.objects["avatar"].data.shape_keys.key_blocks}
print(json.dumps([key.value, sorted(ranges)]))
"""


@pytest.mark.bpy
def test_the_script_widens_every_slider(tmp_path: Path) -> None:
    (script,) = re.findall(r"^```python run blender\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    (tmp_path / "rig.glb").write_bytes(b"".join(rig_glb(full_avatar(), 4) or []))
    command = [blender_program(), "-c", IMPORT + script + ASK]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == [-1.5, [[-10, 10]]]
