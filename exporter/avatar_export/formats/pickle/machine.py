"""A pickle interpreter that can only build inert data.

Python's own unpickler allocates what a length claims before it looks at the file (a few bytes can ask for
gigabytes), and copies every string. This one checks each length against the bytes that are left, leaves long
strings in the file as `Payload`s, and calls nothing but the stand-ins that an allow-list maps names to.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NoReturn

from avatar_export.formats.pickle.steps import STEPS
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

MAX_STEPS = 1_000_000  # a checkpoint's pickle has a few thousand
MAX_LONG_BYTES = 255
STOP = ord(".")
INLINE_BYTES = 1024  # longer strings stay in the file

Persistent = Callable[[object], object]


@dataclass(frozen=True, eq=False)
class Global:
    """What an allowed name stands for: `make` is called where the pickle calls or instantiates it."""

    name: str
    make: Callable[..., object]


class StandIn:
    """An inert object of a pickle: collects its state, and becomes data in `finish`."""

    def build(self, state: object) -> None:
        """Take the state that the pickle gives. Raises ValueError for a state that is not of its kind."""
        raise ValueError(f"{type(self).__name__} takes no state")

    def finish(self, name: str) -> object:
        """The data, called `name` in messages. Raises AvatarError if it is not sound."""
        raise NotImplementedError


@dataclass(eq=False)
class Payload:
    """A string that was left where it lies: bytes, utf8 text, or latin1 (a Python 2 string)."""

    source: Path | bytes = field(repr=False)
    offset: int
    length: int
    kind: str
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
        return _decode(self.stored(), self.kind)

    def run(self) -> tuple[Path | bytes, int, int]:
        """Source, offset and length of the raw bytes; text is encoded to latin1, as NumPy means it."""
        if self.kind != "utf8":
            return self.source, self.offset, self.length
        if self._raw is None:
            self._raw = self.stored().decode("utf8").encode("latin1")
        return self._raw, 0, len(self._raw)


class Machine:
    """Runs one pickle from `offset` of `source`; `file` is for messages."""

    def __init__(
        self,
        source: Path | bytes,
        file: object,
        allowed: Mapping[str, Global],
        persistent: Persistent | None = None,
        offset: int = 0,
    ):
        self.source, self.file, self.allowed, self.persistent = source, file, allowed, persistent
        self.start = offset
        self.stack: list[object] = []
        self.marks: list[list[object]] = []
        self.memo: dict[int, object] = {}
        self.steps = 0

    def load(self) -> object:
        """What the pickle describes, made of plain values, Payloads and StandIns.

        Raises AvatarError for every fault: another global, lengths that lie, damage of any kind.
        """
        try:
            with BytesIO(self.source) if isinstance(self.source, bytes) else open_file(self.source) as stream:
                self.stream: BinaryIO = stream
                self.size = stream.seek(0, 2)
                stream.seek(self.start)
                return self._run()
        except (IndexError, KeyError, TypeError, ValueError, OverflowError, struct.error) as error:
            reason = f"{type(error).__name__}: {str(error)[:100]}"
            raise AvatarError(f"is a damaged pickle ({reason!a})", file=self.file) from error
        except (RecursionError, MemoryError, OSError) as error:
            raise AvatarError(
                f"cannot be read as a pickle ({type(error).__name__})", file=self.file
            ) from error

    def _run(self) -> object:
        while self.steps < MAX_STEPS:
            self.steps += 1
            code = self.take(1)[0]
            if code == STOP:
                return self.stack.pop()
            step = STEPS.get(code)
            if step is None:
                self.refuse(f"uses pickle operation 0x{code:02x}")
            step(self)
        return self.refuse(f"has more than {MAX_STEPS} steps")

    def refuse(self, what: str) -> NoReturn:
        raise AvatarError(f"{what}; refused, since no avatar file needs it", file=self.file)

    def take(self, count: int) -> bytes:
        data = b"" if count > self.size else self.stream.read(count)
        if len(data) != count:
            self.too_long(count)
        return data

    def skip(self, count: int) -> None:
        if count > self.size - self.stream.tell():
            self.too_long(count)
        self.stream.seek(count, 1)

    def too_long(self, count: int) -> NoReturn:
        left = max(0, self.size - self.stream.tell())
        raise AvatarError(
            f"a pickle claims {count} bytes more where {left} are left; the file is truncated or damaged",
            file=self.file,
        )

    def number(self, layout: str) -> int:
        value: int = struct.unpack(layout, self.take(struct.calcsize(layout)))[0]
        return value

    def line(self, limit: int | None = None) -> bytes:
        text = self.stream.readline(-1 if limit is None else limit)
        if not text.endswith(b"\n"):
            raise ValueError("a line has no end")
        return text[:-1]

    def push(self, value: object) -> None:
        self.stack.append(value)

    def pop_mark(self) -> list[object]:
        items, self.stack = self.stack, self.marks.pop()
        return items

    def string(self, length: int, kind: str) -> None:
        at = self.stream.tell()
        if length < 0:
            raise ValueError("a string has a negative length")
        if length <= INLINE_BYTES:
            self.push(_decode(self.take(length), kind))
        else:
            self.skip(length)
            self.push(Payload(self.source, at, length, kind))

    def long(self, length: int) -> None:
        if not 0 <= length <= MAX_LONG_BYTES:
            self.refuse(f"holds a whole number of {length} bytes")
        self.push(int.from_bytes(self.take(length), "little", signed=True))

    def find(self, module: object, name: object) -> None:
        full = f"{module}.{name}"
        if not (isinstance(module, str) and isinstance(name, str)) or full not in self.allowed:
            raise AvatarError(
                f"the pickle asks for {ascii(full[:100])[1:-1]}; refused, since it could run code: "
                "save the data as plain arrays",
                file=self.file,
            )
        self.push(self.allowed[full])

    def call(self) -> None:
        arguments, made = self.stack.pop(), self.stack.pop()
        if not isinstance(made, Global) or not isinstance(arguments, tuple):
            self.refuse("calls something that is no known class")
        self.steps += sum(len(a) for a in arguments if isinstance(a, (list, tuple)))
        self.push(made.make(*arguments))

    def build(self) -> None:
        state, target = self.stack.pop(), self.stack[-1]
        if isinstance(target, StandIn):
            target.build(state)
        elif type(target) is not dict:  # the attributes of an ordered dict (torch's _metadata) are not needed
            self.refuse("sets the state of something that has none")

    def set_items(self, items: list[object]) -> None:
        target = self.stack[-1]
        if type(target) is not dict or len(items) % 2:
            raise ValueError("items are set on no dict")
        for key, value in zip(items[::2], items[1::2], strict=True):
            target[_key(key)] = value

    def append(self, items: list[object]) -> None:
        target = self.stack[-1]
        if type(target) is not list:
            raise ValueError("items are appended to no list")
        target.extend(items)

    def persistent_load(self) -> None:
        if self.persistent is None:
            self.refuse("refers to data outside the pickle")
        self.push(self.persistent(self.stack.pop()))


def _key(key: object) -> str | int:
    if isinstance(key, bytes):
        key = key.decode("latin1")
    if not isinstance(key, (str, int)):
        raise ValueError("a dict key is neither a name nor a number")
    return key


def make_dict(items: object = ()) -> dict[str | int, object]:
    """An ordered dict of a pickle: from nothing or from a list of pairs."""
    if not isinstance(items, (list, tuple)):
        raise ValueError("a dict is made of no pairs")
    pairs = [tuple(pair) for pair in items if isinstance(pair, (list, tuple)) and len(pair) == 2]
    if len(pairs) != len(items):
        raise ValueError("a dict is made of no pairs")
    return {_key(key): value for key, value in pairs}


def _decode(data: bytes, kind: str) -> str | bytes:
    return data if kind == "bytes" else data.decode(kind)
