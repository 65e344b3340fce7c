"""What a pickle becomes before anybody reads its data: allowed names, inert objects, strings left in the file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from avatar_runtime.io.files import open_file


@dataclass(frozen=True, eq=False)
class Global:
    """What an allowed name stands for: `make` is called where the pickle calls or instantiates it."""

    name: str
    make: Callable[..., object]


class StandIn(ABC):
    """An inert object of a pickle: collects its state, and becomes data in `finish`."""

    def build(self, state: object) -> None:
        """Take the state that the pickle gives. Raises ValueError for a state that is not of its kind."""
        raise ValueError(f"{type(self).__name__} takes no state")

    @abstractmethod
    def finish(self, name: str) -> object:
        """The data, called `name` in messages. Raises AvatarError if it is not sound."""


@dataclass(eq=False)
class Payload:
    """A string that stays in the file: bytes, utf8 text, or latin1 (a Python 2 string)."""

    source: Path | bytes = field(repr=False)
    offset: int
    length: int
    kind: str  # "bytes" | "utf8" | "latin1"
    _raw: bytes | None = field(default=None, repr=False)

    def stored(self) -> bytes:
        """The bytes as they lie in the file."""
        if isinstance(self.source, bytes):
            return self.source[self.offset : self.offset + self.length]
        with open_file(self.source) as stream:
            stream.seek(self.offset)
            return stream.read(self.length)

    def value(self) -> str | bytes:
        """The string that the pickle means."""
        return decoded(self.stored(), self.kind)

    def run(self) -> tuple[Path | bytes, int, int]:
        """Source, offset and length of the raw bytes; text is encoded to latin1, as NumPy means it."""
        if self.kind != "utf8":
            return self.source, self.offset, self.length
        if self._raw is None:
            self._raw = self.stored().decode("utf8").encode("latin1")
        return self._raw, 0, len(self._raw)


def decoded(data: bytes, kind: str) -> str | bytes:
    """`data` as a string of `kind` (see Payload). Raises UnicodeError for damaged text."""
    return data if kind == "bytes" else data.decode(kind)


def dict_key(key: object) -> str | int:
    """A key of a pickled dict; bytes are Python 2 names. Raises ValueError for anything but a name or a number."""
    if isinstance(key, bytes):
        key = key.decode("latin1")
    if not isinstance(key, (str, int)):
        raise ValueError("a dict key is neither a name nor a number")
    return key


def make_dict(items: object = ()) -> dict[str | int, object]:
    """An ordered dict of a pickle, from nothing or from a list of pairs. Raises ValueError for anything else."""
    if not isinstance(items, (list, tuple)):
        raise ValueError("a dict is not made from a list of pairs")
    pairs = [tuple(pair) for pair in items if isinstance(pair, (list, tuple)) and len(pair) == 2]
    if len(pairs) != len(items):
        raise ValueError("a dict is not made from a list of pairs")
    return {dict_key(key): value for key, value in pairs}
