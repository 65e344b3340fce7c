"""The sample in the npm package of the web player: `python -m tools.web_sample FILE` packs the trained head.

It is packed by fixed steps, without the search of `avatar-export pack`, so that a build takes seconds. The same avatar
lies on the site's first page (docs/tools/site_links.py).
"""

from __future__ import annotations

import sys
from pathlib import Path

from avatar_export.measure.framing import framing, preview_webp
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import driving_facts, prepare, write
from avatar_runtime import load

HEAD = Path(__file__).parents[1] / "samples" / "trained" / "head_blendshapes"
COARSENESS = 2.0


def sample() -> bytes:
    """The right-handed pack of the head."""
    avatar = with_active_sh(load(HEAD))
    prepared = prepare([avatar], Fineness(COARSENESS))
    played = prepared.levels[0]
    return write(prepared, {"framing": framing(played)} | driving_facts(played), preview_webp(avatar)).file


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(sample())
