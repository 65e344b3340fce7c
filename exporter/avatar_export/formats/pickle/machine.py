"""The stack machine of pickle: its state, and the checked primitives that every operation is made of.

Python's own unpickler allocates what a length claims before it looks at the file (a few bytes can ask for
gigabytes), and copies every string. This machine checks each length against the bytes that are left, keeps long
strings in the file as `Payload`s, and calls only the stand-ins that an allow-list maps names to.
`steps` maps operation codes to these primitives; `load` runs a whole pickle.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO, NoReturn

from avatar_export.formats.pickle.values import Global, Payload, StandIn, decoded, dict_key
from avatar_runtime.io.errors import AvatarError

MAX_LONG_BYTES = 255
INLINE_BYTES = 1024  # longer strings stay in the file

Persistent = Callable[[object], object]


class Machine:
    """The state of one pickle while it runs: the stream, the stack, the marks and the memo.

    `source` is what `stream` reads (payloads refer to it), `file` is named in messages. The primitives raise
    AvatarError for a refused operation and for lengths beyond the file; ValueError, IndexError or KeyError for other
    damage, which `load` turns into AvatarError.
    """

    def __init__(
        self,
        stream: BinaryIO,
        source: Path | bytes,
        file: object,
        allowed: Mapping[str, Global],
        persistent: Persistent | None,
        offset: int,
    ):
        self.stream, self.source, self.file = stream, source, file
        self.allowed, self.persistent = allowed, persistent
        self.stack: list[object] = []
        self.marks: list[list[object]] = []
        self.memo: dict[int, object] = {}
        self.steps = 0  # operations so far, and arguments of calls
        self.size = stream.seek(0, 2)
        stream.seek(offset)

    def refuse(self, what: str) -> NoReturn:
        """Raise AvatarError: the pickle does `what`."""
        raise AvatarError(f"{what}; refused, since no avatar file needs it", file=self.file)

    def take(self, count: int) -> bytes:
        """The next `count` bytes. Raises AvatarError where fewer are left."""
        data = b"" if count > self.size else self.stream.read(count)
        if len(data) != count:
            self.too_long(count)
        return data

    def skip(self, count: int) -> None:
        """Pass over `count` bytes. Raises AvatarError where fewer are left."""
        if count > self.size - self.stream.tell():
            self.too_long(count)
        self.stream.seek(count, 1)

    def too_long(self, count: int) -> NoReturn:
        """Raise AvatarError: the pickle claims `count` bytes more than there are."""
        left = max(0, self.size - self.stream.tell())
        raise AvatarError(
            f"a pickle claims {count} bytes more where {left} are left; the file is truncated or damaged",
            file=self.file,
        )

    def number(self, layout: str) -> int:
        """The next number, of a `struct` layout such as "<I"."""
        value: int = struct.unpack(layout, self.take(struct.calcsize(layout)))[0]
        return value

    def line(self, limit: int | None = None) -> bytes:
        """The bytes up to the end of the line, at most `limit`. Raises ValueError for a line without an end."""
        text = self.stream.readline(-1 if limit is None else limit)
        if not text.endswith(b"\n"):
            raise ValueError("a line has no end")
        return text[:-1]

    def push(self, value: object) -> None:
        """Put `value` on the stack."""
        self.stack.append(value)

    def pop_mark(self) -> list[object]:
        """The items above the last mark; the stack is again as it was when the mark was set."""
        items, self.stack = self.stack, self.marks.pop()
        return items

    def string(self, length: int, kind: str) -> None:
        """Push the next `length` bytes as a string of `kind`; a long one as a Payload."""
        at = self.stream.tell()
        if length < 0:
            raise ValueError("a string has a negative length")
        if length <= INLINE_BYTES:
            self.push(decoded(self.take(length), kind))
        else:
            self.skip(length)
            self.push(Payload(self.source, at, length, kind))

    def long(self, length: int) -> None:
        """Push the next `length` bytes as a signed whole number."""
        if not 0 <= length <= MAX_LONG_BYTES:
            self.refuse(f"holds a whole number of {length} bytes")
        self.push(int.from_bytes(self.take(length), "little", signed=True))

    def find(self, module: object, name: object) -> None:
        """Push what the allow-list holds for `module.name`. Raises AvatarError for any other name."""
        full = f"{module}.{name}"
        if not (isinstance(module, str) and isinstance(name, str)) or full not in self.allowed:
            raise AvatarError(
                f"the pickle asks for {ascii(full[:100])[1:-1]}; refused, since it could run code: "
                "save the data as plain arrays",
                file=self.file,
            )
        self.push(self.allowed[full])

    def call(self) -> None:
        """Call the allowed maker below the tuple of arguments on the stack."""
        arguments, made = self.stack.pop(), self.stack.pop()
        if not isinstance(made, Global) or not isinstance(arguments, tuple):
            self.refuse("calls something that is not a known class")
        self.steps += sum(len(a) for a in arguments if isinstance(a, (list, tuple)))
        self.push(made.make(*arguments))

    def build(self) -> None:
        """Give the state on top of the stack to the stand-in below it."""
        state, target = self.stack.pop(), self.stack[-1]
        if isinstance(target, StandIn):
            target.build(state)
        elif type(target) is not dict:  # the attributes of an ordered dict (torch's _metadata) are not needed
            self.refuse("sets the state of something that has none")

    def set_items(self, items: list[object]) -> None:
        """Set keys and values, in turn, on the dict on top of the stack."""
        target = self.stack[-1]
        if type(target) is not dict or len(items) % 2:
            raise ValueError("items are set on something that is not a dict")
        for key, value in zip(items[::2], items[1::2], strict=True):
            target[dict_key(key)] = value

    def append(self, items: list[object]) -> None:
        """Append `items` to the list on top of the stack."""
        target = self.stack[-1]
        if type(target) is not list:
            raise ValueError("items are appended to something that is not a list")
        target.extend(items)

    def persistent_load(self) -> None:
        """Replace the reference on top of the stack by the data outside the pickle that it names."""
        if self.persistent is None:
            self.refuse("refers to data outside the pickle")
        self.push(self.persistent(self.stack.pop()))
