"""`python -m bench.visitor [HEAD ...]`: how well a page reads the face of heads whose channels are known.

HEAD is a file or folder that `read` takes; the default is the sample head. Each head does the takes of `takes`, drawn
by `gl`. A browser (Chromium, or AVATAR_BROWSER) gets them as its camera, and what its page reads is compared with what
is true. The page's table was learnt on other heads. `--keep FOLDER` keeps the films.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

from avatar_export import read
from bench.visitor import film, takes
from bench.visitor.judge import Judged, judged, table

ROOT = Path(__file__).parents[2]
SAMPLE = ROOT / "samples" / "trained" / "head_blendshapes"


def watched(head: Path, folder: Path, parts: dict[str, takes.Array], fps: int, backend: str = "gl") -> Judged:
    """Plays the parts, one after the other, to the page, and judges what it saw. Needs Node and a browser."""
    folder.mkdir(parents=True, exist_ok=True)
    channels = takes.joined(parts)
    if not (folder / "film.json").exists():
        images = film.drawn(read(head), channels, backend)
        film.write_y4m(folder / "camera.y4m", images, fps)
        film.write_pictures(folder / "f", images)
        (folder / "film.json").write_text(json.dumps({"fps": fps, "images": len(images)}))
    command = ["node", str(ROOT / "players" / "web" / "bench" / "visitor.mjs"), str(folder)]
    subprocess.run(command, check=True)
    return judged(json.loads((folder / "rows.json").read_text()), channels, takes.places(parts))


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.visitor", description=__doc__)
    parser.add_argument("heads", type=Path, nargs="*", default=[SAMPLE])
    parser.add_argument("--keep", type=Path, help="folder for the films")
    parser.add_argument("--fps", type=int, default=takes.FPS, help="less plays the film in slow motion")
    given = parser.parse_args()
    parts = {"ramps": takes.ramps(), "mixed": takes.mixed(), "recorded": takes.recorded()}
    with tempfile.TemporaryDirectory() as temporary:
        for head in given.heads:
            folder = (given.keep or Path(temporary)) / head.stem
            print(f"\n{head.name}")
            print(*table(watched(head, folder, parts, given.fps)), sep="\n")


if __name__ == "__main__":
    main()
