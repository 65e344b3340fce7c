"""A pickle interpreter that can only build inert data.

Python's own unpickler allocates what a length claims before it looks at the file (a few bytes can ask for
gigabytes), and copies every string. This one checks each length against the bytes that are left, leaves long
strings in the file as `Payload`s, and calls nothing but the stand-ins that an allow-list maps names to.
"""

from __future__ import annotations

import codecs
import struct
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NoReturn

from avatar_runtime.errors import AvatarError

MAX_STEPS = 1_000_000  # a checkpoint's pickle has a few thousand
MAX_LONG_BYTES = 255
MAX_NUMBER_TEXT = 64
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
        with self.source.open("rb") as stream:
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
            with BytesIO(self.source) if isinstance(self.source, bytes) else self.source.open("rb") as stream:
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


def _escaped(text: bytes) -> str:
    """The string of a protocol 0 line, a quoted Python 2 literal."""
    if len(text) < 2 or text[:1] != text[-1:] or text[:1] not in (b"'", b'"'):
        raise ValueError("a string line has no quotes")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return codecs.escape_decode(text[1:-1])[0].decode("latin1")


def _unicode_line(text: bytes) -> str:
    value = text.decode("raw-unicode-escape")
    value.encode("utf8")  # a lone surrogate could never be printed
    return value


def _whole(text: bytes) -> int | bool:
    return {b"00": False, b"01": True}[text] if text in (b"00", b"01") else int(text.rstrip(b"L"))


def _global_lines(m: Machine) -> None:
    module = m.line(200).decode("latin1")
    m.find(module, m.line(200).decode("latin1"))


def _stack_global(m: Machine) -> None:
    name, module = m.stack.pop(), m.stack.pop()
    m.find(module, name)


def _mark(m: Machine) -> None:
    m.marks.append(m.stack)
    m.stack = []


def _memoize(m: Machine, index: int) -> None:
    m.memo[index] = m.stack[-1]


def _tuple(m: Machine, count: int) -> None:
    items = m.stack[-count:]
    if len(items) != count:
        raise IndexError("the stack is too short")
    m.stack[-count:] = [tuple(items)]


def _dict(m: Machine) -> None:
    items = m.pop_mark()
    m.push({})
    m.set_items(items)


def _set_item(m: Machine) -> None:
    value, key = m.stack.pop(), m.stack.pop()
    m.set_items([key, value])


def _pop(m: Machine) -> None:
    if m.stack:
        m.stack.pop()
    else:
        m.pop_mark()


def _protocol(m: Machine) -> None:
    if m.number("<B") > 5:
        m.refuse("has a pickle protocol above 5")


Step = Callable[[Machine], object]
STOP = ord(".")
STEPS: dict[int, Step] = {
    ord("("): _mark,
    ord("0"): _pop,
    ord("1"): lambda m: m.pop_mark(),
    ord("2"): lambda m: m.push(m.stack[-1]),
    ord("N"): lambda m: m.push(None),
    0x88: lambda m: m.push(True),
    0x89: lambda m: m.push(False),
    ord("]"): lambda m: m.push([]),
    0x8F: lambda m: m.push([]),  # a set, such as chumpy's bookkeeping has, is read as a list
    ord("}"): lambda m: m.push({}),
    ord(")"): lambda m: m.push(()),
    ord("I"): lambda m: m.push(_whole(m.line(MAX_NUMBER_TEXT))),
    ord("L"): lambda m: m.push(_whole(m.line(MAX_NUMBER_TEXT))),
    ord("F"): lambda m: m.push(float(m.line(MAX_NUMBER_TEXT))),
    ord("G"): lambda m: m.push(struct.unpack(">d", m.take(8))[0]),
    0x8A: lambda m: m.long(m.number("<B")),
    0x8B: lambda m: m.long(m.number("<i")),
    ord("S"): lambda m: m.push(_escaped(m.line())),
    ord("V"): lambda m: m.push(_unicode_line(m.line())),
    ord("t"): lambda m: m.push(tuple(m.pop_mark())),
    ord("l"): lambda m: m.push(m.pop_mark()),
    ord("d"): _dict,
    0x85: lambda m: _tuple(m, 1),
    0x86: lambda m: _tuple(m, 2),
    0x87: lambda m: _tuple(m, 3),
    ord("a"): lambda m: m.append([m.stack.pop()]),
    ord("e"): lambda m: m.append(m.pop_mark()),
    0x90: lambda m: m.append(m.pop_mark()),
    ord("s"): _set_item,
    ord("u"): lambda m: m.set_items(m.pop_mark()),
    ord("c"): _global_lines,
    0x93: _stack_global,
    ord("R"): Machine.call,
    0x81: Machine.call,
    ord("b"): Machine.build,
    ord("Q"): Machine.persistent_load,
    ord("g"): lambda m: m.push(m.memo[int(m.line(MAX_NUMBER_TEXT))]),
    ord("p"): lambda m: _memoize(m, int(m.line(MAX_NUMBER_TEXT))),
    0x94: lambda m: _memoize(m, len(m.memo)),
    0x80: _protocol,
    0x95: lambda m: m.number("<Q"),  # a frame is only a hint for buffering
}


def _number_step(layout: str) -> Step:
    return lambda m: m.push(m.number(layout))


def _get_step(layout: str) -> Step:
    return lambda m: m.push(m.memo[m.number(layout)])


def _put_step(layout: str) -> Step:
    return lambda m: _memoize(m, m.number(layout))


def _string_step(layout: str, kind: str) -> Step:
    return lambda m: m.string(m.number(layout), kind)


STEPS |= {ord(code): _number_step(layout) for code, layout in (("J", "<i"), ("K", "<B"), ("M", "<H"))}
STEPS |= {ord(code): _get_step(layout) for code, layout in (("h", "<B"), ("j", "<I"))}
STEPS |= {ord(code): _put_step(layout) for code, layout in (("q", "<B"), ("r", "<I"))}
STEPS |= {
    code: _string_step(layout, kind)
    for code, layout, kind in (
        (ord("U"), "<B", "latin1"),
        (ord("T"), "<i", "latin1"),
        (ord("X"), "<I", "utf8"),
        (0x8C, "<B", "utf8"),
        (0x8D, "<Q", "utf8"),
        (ord("C"), "<B", "bytes"),
        (ord("B"), "<I", "bytes"),
        (0x8E, "<Q", "bytes"),
        (0x96, "<Q", "bytes"),
    )
}
