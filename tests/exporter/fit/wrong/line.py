"""A line of the table: a mistake, how it is stated to be found, and the cases that it was tried on."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.exporter.fit.table import said
from tests.exporter.fit.wrong.inputs import Inputs, Make

KNOWN, DOUBT = "named", "doubted"


@dataclass(frozen=True)
class Line:
    """A mistake, and its cases by "SYSTEM, STRENGTH"."""

    mistake: str
    stated: str  # KNOWN: `words` name it; DOUBT: a warning with them
    words: str  # a pattern
    cases: Mapping[str, Make]

    def found(self, said: str) -> bool:
        """Whether what is said of a case is what the line states."""
        return re.search(self.words, said) is not None


def tried(make: Make, inputs: Inputs, folder: Path) -> str:
    """What is said of a case, whose files are made in `folder`."""
    folder.mkdir(parents=True)
    return said(make(inputs, folder))
