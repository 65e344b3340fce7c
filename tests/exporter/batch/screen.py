"""A terminal as far as rich needs one: text, line ends, and the sequences that move the cursor or clear a line."""

from __future__ import annotations

import re

SEQUENCE = re.compile(r"\x1b\[([?0-9;]*)([A-Za-z])")


class Screen:
    """Rows of text, and a cursor. Raises AssertionError for a sequence that it does not know."""

    def __init__(self) -> None:
        self._rows = [""]
        self._row = self._column = 0

    def lines(self) -> list[str]:
        """What is to be seen, without empty lines."""
        return [row.rstrip() for row in self._rows if row.strip()]

    def write(self, text: str) -> None:
        """Shows a text."""
        at = 0
        while at < len(text):
            found = SEQUENCE.match(text, at)
            if found:
                self._obey(found[1], found[2])
                at = found.end()
            else:
                self._put(text[at])
                at += 1

    def _put(self, letter: str) -> None:
        if letter == "\r":
            self._column = 0
        elif letter == "\n":
            self._row, self._column = self._row + 1, 0
            self._rows += [""] * (self._row + 1 - len(self._rows))
        else:
            row = self._rows[self._row].ljust(self._column)
            self._rows[self._row] = row[: self._column] + letter + row[self._column + 1 :]
            self._column += 1

    def _obey(self, numbers: str, letter: str) -> None:
        if letter == "A":  # up
            self._row = max(0, self._row - int(numbers or 1))
        elif letter == "K":  # clear the line
            self._rows[self._row] = ""
        else:  # colours; the cursor is hidden or shown
            assert letter == "m" or numbers == "?25", f"{numbers}{letter}"
