"""The packs of the Unity package's samples: `python -m samples.unity` writes them anew.

They are made from trained sample avatars, left-handed as Unity is.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "players" / "unity" / "Samples~"
PACKS = {  # below FOLDER: the bundle in samples/trained
    "Head/Resources/sample_head.avatar": "head_blendshapes",
    "Body/Resources/sample_body.avatar": "body_splatting",
    "Face/Resources/sample_face.avatar": "head_blendshapes",  # each sample is imported alone
}
OPTIONS = ("--handedness", "left", "--force")


def main(folder: Path = FOLDER) -> None:
    """Writes every pack below `folder`."""
    made: dict[str, Path] = {}
    for name, bundle in PACKS.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if bundle in made:
            shutil.copyfile(made[bundle], file)
            continue
        source = ROOT / "samples" / "trained" / bundle
        command = [sys.executable, "-m", "avatar_export", "pack", str(source), "-o", str(file), *OPTIONS]
        subprocess.run(command, check=True)
        made[bundle] = file


if __name__ == "__main__":
    main()
