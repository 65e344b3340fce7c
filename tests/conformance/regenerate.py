"""Rewrites the committed vectors: `python -m tests.conformance.regenerate`. Regenerating blesses new behaviour."""

from __future__ import annotations

import shutil

from avatar_runtime.conformance import encode, make_reference
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import DATA, PIXELS, ROWS, cases_of


def regenerate() -> None:
    """A folder for every avatar, nothing else in DATA."""
    shutil.rmtree(DATA, ignore_errors=True)
    for name, make in AVATARS.items():
        avatar = make()
        reference = make_reference(
            avatar, cases_of(name, avatar), rows=ROWS, pixels=PIXELS, generator="tests/conformance"
        )
        (DATA / name).mkdir(parents=True)
        for file, data in encode(reference).items():
            (DATA / name / file).write_bytes(data)


if __name__ == "__main__":
    regenerate()
