"""The sample head in a lit scene of Godot: `python -m tools.godot.demo OUT` writes a project to open in the editor.

`--film FILE.webp` also imports it and films its first seconds, in the engine that `tools.godot.fetch` got.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from tests.players.godot import engine

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_export.relight import relightable
from avatar_export.writers.rig_glb import rig_glb
from avatar_runtime.bundle import load

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "samples" / "godot"
HEAD = ROOT / "samples" / "trained" / "head_blendshapes"
FPS, FRAMES = 12, 57  # the 4.73 s in which samples/godot/demo.gd comes round
SETTINGS = """[application]
config/name="Gaussian avatar"
run/main_scene="res://demo.tscn"
[display]
window/size/viewport_width=480
window/size/viewport_height=320
[rendering]
anti_aliasing/quality/msaa_3d=2
"""


def main() -> None:
    """Writes the project, and the film."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", type=Path, help="folder of the project")
    parser.add_argument("--film", type=Path, help="an animated WebP")
    given = parser.parse_args()
    write_project(given.out)
    if given.film:
        film(given.out, given.film)


def write_project(out: Path) -> None:
    """The add-on, the scene, the head as a pack that takes light, and its mesh for the shadow."""
    engine.project(out, settings=SETTINGS)
    for file in SCENE.iterdir():
        shutil.copy(file, out)
    head = load(HEAD)
    (out / "rig.glb").write_bytes(b"".join(rig_glb(head) or ()))
    (out / "head.avatar").write_bytes(pack([relightable(head)], Fineness()).file)


def shots(project: Path, folder: Path, count: int) -> list[Image.Image]:
    """The first frames of the scene, as the engine writes them into a folder."""
    engine.imported(project).clean()
    written = ("--write-movie", f"{folder}/frame.png", "--fixed-fps", str(FPS), "--quit-after", str(count))
    engine.run(project, *written).clean()
    return [Image.open(file).convert("RGB") for file in sorted(folder.glob("frame*.png"))]


def film(project: Path, out: Path) -> None:
    """What the engine shows, round and round."""
    with tempfile.TemporaryDirectory() as folder:
        _, *frames = shots(project, Path(folder), FRAMES + 1)  # the engine has no sky before its first frame
    lasts_ms = 1000 // FPS
    whole = {"quality": 75, "method": 6, "kmin": 0, "kmax": 1}  # each frame by itself: nothing trails
    frames[0].save(out, save_all=True, append_images=frames[1:], duration=lasts_ms, loop=0, **whole)
    print(f"{out}: {len(frames)} frames, {out.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
