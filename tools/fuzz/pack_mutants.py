"""Packs that are changed by chance, most of them repaired in sizes and checksums, so that deep checks see them."""

from __future__ import annotations

import gzip
import json
import re
import zlib
from collections.abc import Callable
from random import Random
from typing import Any

from tools.fuzz.mutate import changed, places, wounded

SPELLINGS = (
    "8.0", "48e0", "-0", "-0.0", "1e400", "-1e999", "9007199254740992", "9007199254740993", "-9007199254740993",
    "1" * 400, "0.1e1", "5E-1", "01", "1.", ".5", "+1", "0x10", "NaN", "Infinity", "-Infinity", "1e-400", "4294967295",
    "4294967296", "4294967295.0", "2147483648", "9007199254740993.0", "1e16", "true", "null", "[]",
    "{}", '"1"', "1 1", "",
)  # fmt: skip
ODD_TEXTS = (
    "\\ud800", "\\udc00", "\\ud83d\\ude00", "\\ude00\\ud83d", "\\u0000", "\\u001b[31m", "\\u202e", "\\x41", "\\", "\t",
    "\n", "\x00", "\x7f", "\u2028", "\u00e9", "\U0001f600", "\\/", "\\u00e", "a" * 97, "",
)  # fmt: skip
BREAKS = (
    b"\xef\xbb\xbf", b"\xff", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xe2\x82", b"\0", b"\x0b",
    b"\xc2\xa0", b"//", b",",
)  # fmt: skip
Parts = tuple[dict[str, Any], Any, bytes]  # header without the document, document, tensors' bytes


def mutant(whole: bytes, rng: Random) -> bytes:
    """One changed pack: of ten, nine are repaired."""
    kind = rng.choices(list(KINDS), WEIGHTS)[0]
    try:
        return KINDS[kind](whole, rng)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError):
        return wounded(whole, rng)  # an earlier change has left no structure


def _opened(whole: bytes) -> Parts:
    body = gzip.decompress(whole)
    end = 8 + int.from_bytes(body[:8], "little")
    header = json.loads(body[8:end])
    return header, json.loads(header.pop("__metadata__")["pack"]), body[end:]


def _file(header: dict[str, Any], document: Any, tensors: bytes) -> bytes:
    text = json.dumps({"__metadata__": {"pack": json.dumps(document)}, **header})
    return _zipped(text.encode(), tensors)


def _zipped(header: bytes, tensors: bytes) -> bytes:
    return gzip.compress(len(header).to_bytes(8, "little") + header + tensors, 1, mtime=0)


def _document(whole: bytes, rng: Random) -> bytes:
    header, document, tensors = _opened(whole)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        document = changed(document, rng)
    return _file(header, document, tensors)


def _alike(whole: bytes, rng: Random) -> bytes:
    """A value of the document becomes another one that the document holds under the same name, or nearly it."""
    header, document, tensors = _opened(whole)
    spots = [(holder, key) for holder, key in places(document) if not isinstance(holder[key], dict)]
    for _ in range(rng.choice((1, 1, 2))):
        holder, key = rng.choice(spots)
        same = [h[k] for h, k in spots if k == key or type(h[k]) is type(holder[key])]
        value = rng.choice(same)
        if type(value) in (int, float) and rng.random() < 0.5:
            value = rng.choice((value + 1, value - 1, value * 2, value // 2, float(value), -value))
        holder[key] = value
    return _file(header, document, tensors)


def _items(whole: bytes, rng: Random) -> bytes:
    """An item of a list of the document is dropped, doubled or exchanged with another."""
    header, document, tensors = _opened(whole)
    lists = [holder[key] for holder, key in places(document) if isinstance(holder[key], list) and holder[key]]
    items, kind = rng.choice(lists), rng.randrange(3)
    at, other = rng.randrange(len(items)), rng.randrange(len(items))
    if kind == 0:
        del items[at]
    elif kind == 1:
        items.insert(other, json.loads(json.dumps(items[at])))
    else:
        items[at], items[other] = items[other], items[at]
    return _file(header, document, tensors)


def _header(whole: bytes, rng: Random) -> bytes:
    header, document, tensors = _opened(whole)
    header["__metadata__"] = {"pack": json.dumps(document)}
    return _zipped(json.dumps(changed(header, rng)).encode(), tensors)


def _numbers(whole: bytes, rng: Random) -> bytes:
    """Bytes of one tensor: some, or a plane of them, mostly to extreme values."""
    header, document, tensors = _opened(whole)
    begin, end = rng.choice([*header.values()])["data_offsets"]
    out = bytearray(tensors)
    for _ in range(rng.randrange(1, 5) if end > begin else 0):
        at, value = rng.randrange(begin, end), rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
        run = rng.choice((1, 1, 1, 4, (end - begin) // 4, end - begin))
        out[at : min(at + run, end)] = bytes([value]) * (min(at + run, end) - at)
    return _file(header, document, bytes(out))


def _text(whole: bytes, rng: Random) -> bytes:
    """JSON as nobody writes it: in the document or in the header."""
    header, document, tensors = _opened(whole)
    inner = json.dumps(document)
    if rng.random() < 0.6:
        inner = _respelt(inner, rng)
    text = json.dumps({"__metadata__": {"pack": inner}, **header})
    data = (text if rng.random() < 0.6 else _respelt(text, rng)).encode("utf-8", "surrogatepass")
    kind = rng.randrange(8)
    if kind == 0:
        at = rng.choice((0, len(data), rng.randrange(len(data))))
        data = data[:at] + rng.choice(BREAKS) + data[at:]
    elif kind == 1:
        other = rng.choice(("utf-16", "utf-16-le", "utf-32"))
        data = data.decode("utf-8", "surrogatepass").encode(other, "surrogatepass")
    return _zipped(data, tensors)


def _respelt(text: str, rng: Random) -> str:
    kind = rng.randrange(6)
    if kind == 0:
        number = rng.choice([*re.finditer(r"(?<=[:\s\[,])-?[0-9][0-9.eE+-]*", text)])
        value = rng.choice((*SPELLINGS, f"{number[0]}.0", f"{number[0]}e0"))
        return text[: number.start()] + value + text[number.end() :]
    if kind == 1:
        quote = rng.choice([*re.finditer('"', text)]).end()
        return text[:quote] + rng.choice(ODD_TEXTS) + text[quote:]
    if kind == 2:  # a member twice, or one more
        brace = rng.choice([*re.finditer(r"\{", text)]).end()
        keys = re.findall(r'"(\w+)":', text)
        member = f'"{rng.choice((*keys, "new"))}": {rng.choice((*SPELLINGS, "1"))}'
        return text[:brace] + member + (", " if text[brace] != "}" else "") + text[brace:]
    if kind == 3:
        depth = rng.choice((3, 55, 58, 59, 60, 61, 62, 63, 64, 65, 66, 300))
        member = '"deep": ' + "[" * depth + "]" * depth
        return "{" + member + ", " + text[1:]
    if kind == 4:
        letter = rng.choice([*re.finditer(r"[a-z]", text)])
        return f"{text[: letter.start()]}\\u{ord(letter[0]):04x}{text[letter.end() :]}"
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(' \n\t\r\f\u00a0,}]:"/') + text[at:]


def _member(whole: bytes, rng: Random) -> bytes:
    """gzip around sound contents: other fields, further members, other ends."""
    data = gzip.decompress(whole)
    deflate = zlib.compressobj(rng.choice((0, 1, 9)), zlib.DEFLATED, -15)
    raw = deflate.compress(data) + deflate.flush()
    tail = zlib.crc32(data).to_bytes(4, "little") + len(data).to_bytes(4, "little")
    flags = rng.choice((0, 0, 1, 2, 4, 8, 16, 30, 32, 64, 128, 255))
    head = b"\x1f\x8b" + bytes([rng.choice((8, 8, 8, 8, 7, 9)), flags]) + rng.randbytes(6)
    head += b"\x03\0abc" * (flags >> 2 & 1) + b"name\0" * (flags >> 3 & 1) + b"words\0" * (flags >> 4 & 1)
    if flags & 2:
        head += ((zlib.crc32(head) & 0xFFFF) ^ rng.choice((0, 0, 1))).to_bytes(2, "little")
    empty = gzip.compress(b"", mtime=0)
    file = head + raw + tail
    around = (
        file, file, empty + file, file + empty, file + b"\0", b"\0" + file, file + file, file[: -rng.randrange(1, 12)],
        head + raw + rng.randbytes(1) + tail, head + raw + tail[:4] + rng.randbytes(4),
        head + raw + rng.randbytes(4) + tail[4:],
    )  # fmt: skip
    return rng.choice(around)


KINDS: dict[str, Callable[[bytes, Random], bytes]] = {
    "document": _document, "alike": _alike, "items": _items, "header": _header, "numbers": _numbers, "text": _text,
    "member": _member, "raw": wounded,
}  # fmt: skip
WEIGHTS = (20, 20, 10, 8, 20, 14, 4, 4)
