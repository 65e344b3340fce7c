"""Figures of the films: `python -m bench.films FILMS [--tracks FOLDER] [--avatars FOLDER]`; and what must hold.

FILMS is what `python -m samples.films` wrote. `--tracks` holds NAME.npz, NAME/track.npz or NAME/capture/track.npz for
each film; `--avatars` holds for each film a folder NAME that `avatar-export make` wrote. Films without are left out.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from samples.films.table import FILMS
from samples.films.truth import load

from avatar_trainer.film.capture import WORK
from avatar_trainer.film.fit.fitting import STAGES
from avatar_trainer.film.follow import followed_again
from bench.films import avatars, tracks


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m bench.films", description=__doc__)
    parser.add_argument("films", type=Path)
    parser.add_argument("--tracks", type=Path)
    parser.add_argument("--avatars", type=Path)
    parser.add_argument(
        "--stages", action="store_true", help="fit the captures of --tracks again by fewer stages"
    )
    given = parser.parse_args()
    names = [film.name for film in FILMS if (given.films / film.name / "truth.npz").is_file()]
    tracked, learnt = {}, {}
    for name in names:
        path = tracks.track_of(given.tracks, name) if given.tracks else None
        for stage in STAGES[: -1 if given.stages else 0] if path else ():
            again = followed_again(path.parent, path.parent / WORK, stage)
            tracked[name, stage] = tracks.figures(load(given.films / name), tracks.Tracked(vars(again)))
        if path:
            tracked[name, "all"] = tracks.figures(load(given.films / name), tracks.tracked(path))
        if given.avatars and (given.avatars / name / "bundle").is_dir():
            with tempfile.TemporaryDirectory() as scratch:
                learnt[name] = avatars.figures(load(given.films / name), given.avatars / name, Path(scratch))
    if not tracked and not learnt:
        parser.error(f"no track and no avatar of the {len(names)} films in {given.films}")
    for lines in ([tracks.table(tracked)] if tracked else []) + ([avatars.table(learnt)] if learnt else []):
        print("\n".join(lines), end="\n\n")


if __name__ == "__main__":
    main()
