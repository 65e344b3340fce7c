"""The operations of pickle protocols 0 to 5 that data needs, by their code, as steps of a Machine.

Everything else is refused: operations that make instances in other ways (i, o, 0x92), extension
codes (0x82 to 0x84), frozen sets, text references (P) and buffers outside the pickle (0x97, 0x98).
"""

from __future__ import annotations

import codecs
import struct
import warnings
from collections.abc import Callable

from avatar_export.formats.pickle.machine import Machine

MAX_NUMBER_TEXT = 64


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
    ord("R"): lambda m: m.call(),
    0x81: lambda m: m.call(),
    ord("b"): lambda m: m.build(),
    ord("Q"): lambda m: m.persistent_load(),
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
