"""Films of computed heads, with their truth: `python -m samples.films OUT [--only NAME ...] [--seconds S]`.

Heads that no tracker saw - random identities and the scan, painted skins - move as recorded faces did, before a room,
and are filmed by a fixed camera with motion blur, noise and H.264. Needs PyAV (`av`).
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from samples.films.render import SIZE, scene
from samples.films.table import FILMS, film
from samples.films.write import write_film


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m samples.films", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write into: one folder a film")
    parser.add_argument(
        "--only", nargs="+", choices=[one.name for one in FILMS], metavar="NAME", help="these films"
    )
    parser.add_argument("--seconds", type=float, help="of each film; without it as long as the table says")
    parser.add_argument("--size", type=int, default=SIZE, help="pixels along an edge of the square images")
    given = parser.parse_args()
    for name in given.only or [one.name for one in FILMS]:
        begin = time.perf_counter()
        made = scene(film(name), given.seconds, given.size)
        path = write_film(made, given.out / name)
        print(f"{path}  {made.frames} frames, {time.perf_counter() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
