"""What a film's bytes state before a decoder sees it: its kind, and the boxes of MP4 and MOV.

Only kinds that are known here reach the decoder. Boxes state what it does not tell: tracks, rotation, HDR, the lens.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

from avatar_runtime import AvatarError

HEAD = 400  # bytes that tell: two packets of an MPEG transport stream
MP4_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip", b"pnot")
PICTURE_BRANDS = (b"heic", b"heix", b"heim", b"hevc", b"hevx", b"mif1", b"msf1", b"avif", b"avis")
PICTURES = (b"\xff\xd8\xff", b"\x89PNG", b"GIF8", b"BM....\0\0\0\0", b"II*\0", b"MM\0*", b"RIFF....WEBP")
SOUNDS = (b"ID3", b"\xff\xfb", b"\xff\xf3", b"\xff\xf1", b"fLaC", b"RIFF....WAVE", b"OggS")
FILMS = {"mkv": b"\x1aE\xdf\xa3", "avi": b"RIFF....AVI ", "mpeg": b"\0\0\1\xba"}
PACKETS = ((0, 188), (4, 192))  # first byte and length of MPEG transport packets; each begins with SYNC
SYNC = 0x47
REFUSED = {"dvh1": "Dolby Vision without a base layer", "dvhe": "Dolby Vision without a base layer"}

MOST_BOXES = 200_000  # at one level: a live recording has some thousand fragments
LARGEST_INDEX = 256 << 20  # bytes of `moov`; that of an hour at 240 frames a second has some 30 MB
TRANSFERS = {16: "pq", 18: "hlg"}  # ISO/IEC 23091-2
LENS = b"com.apple.quicktime.camera.focal_length.35mm_equivalent"
WRONG_ANGLE = 0.02  # of a matrix that is no quarter turn: the sine of about a degree
USUAL_STEP = 0.95  # of the frames have the same length in a film of constant rate
NUMBERS = {21: "int", 22: "unsigned", 65: ">b", 66: ">h", 67: ">i", 74: ">q", 75: ">B", 76: ">H", 77: ">I"}
NUMBERS |= {78: ">Q", 23: ">f", 24: ">d"}  # of QuickTime's metadata: well-known type to format
Box = tuple[bytes, int, int]  # kind, first byte of what it holds, byte behind it


@dataclass
class Stated:
    """The first video track, and which kinds of tracks there are."""

    kinds: list[str] = field(default_factory=list)  # "vide", "soun" ... a track
    codec: str = ""
    width: int = 0  # pixels as stored
    height: int = 0
    fps: float = 0.0  # mean; 0: not stated (fragments)
    seconds: float = 0.0  # shown, by the edit list where there is one; 0: not stated
    constant: bool = True  # frames of one length
    rotation: int = 0  # degrees clockwise that make it upright
    mirrored: bool = False  # left and right are changed, after the rotation
    transfer: str = "sdr"
    focal_35mm: float | None = None  # of a picture of 24x36 mm with the same field of view


def expect_film(file: BinaryIO, path: object) -> str:
    """What the film is: mp4, mkv, avi or mpeg. Raises AvatarError for everything else."""
    file.seek(0)
    head = file.read(HEAD)
    if not head:
        raise AvatarError("is empty; copy it once more", file=path)
    if head[4:8] in MP4_BOXES and head[8:12] not in PICTURE_BRANDS:
        return "mp4"
    for kind, magic in FILMS.items():
        if _begins(head, magic):
            return kind
    if any(len(head) > at + length and head[at] == head[at + length] == SYNC for at, length in PACKETS):
        return "mpeg"
    if head[4:8] == b"ftyp" or any(_begins(head, magic) for magic in PICTURES):
        raise AvatarError("is a still picture, not a video; film the face for 30 seconds", file=path)
    if any(_begins(head, magic) for magic in SOUNDS):
        raise AvatarError("has sound but no picture; film the face with the camera of a phone", file=path)
    raise AvatarError("is no video that is known here; give MP4, MOV, WebM, MKV or AVI", file=path)


def expect_decodable(codec: str, path: object) -> None:
    """Raise AvatarError for a codec whose colours would be wrong."""
    if codec in REFUSED:
        raise AvatarError(f"is {REFUSED[codec]}; film with HDR off, or convert it to H.264", file=path)


def fourcc(code: int) -> str:
    """A codec's four letters."""
    return code.to_bytes(4, "little", signed=code < 0).decode("latin-1").strip("\0 ").lower()


def read(file: BinaryIO, name: object) -> Stated:
    """What the file states. Raises AvatarError, naming `name`, if it is cut off, is broken or has no index."""
    size = file.seek(0, os.SEEK_END)
    index: bytes | None = None
    try:
        for kind, start, end in _of_file(file, size):
            if kind in (b"moov", b"mdat") and end > size:
                raise AvatarError(
                    f"is cut off: it should have {end} bytes and has {size}; copy it once more", file=name
                )
            if kind == b"moov" and index is None:
                if end - start > LARGEST_INDEX:
                    raise AvatarError(f"has an index of {end - start} bytes; film it again", file=name)
                file.seek(start)
                index = file.read(end - start)
        if index is None:
            raise AvatarError(
                "has no index (moov): the recording was cut off or copied in part; copy it once more",
                file=name,
            )
        return _movie(index)
    except (struct.error, ValueError, ZeroDivisionError, OverflowError) as error:
        raise AvatarError(f"is a broken MP4 file ({error}); copy it once more", file=name) from None


def _of_file(file: BinaryIO, size: int) -> Iterator[Box]:
    at = 0
    for _ in range(MOST_BOXES):
        file.seek(at)
        head = file.read(16)
        if len(head) < 8:
            return
        yield (box := _box(head, at, size))
        at = box[2]
    raise ValueError(f"more than {MOST_BOXES} boxes")


def _inside(data: bytes, start: int = 0, end: int | None = None) -> Iterator[Box]:
    """The boxes between two bytes."""
    at, end = start, len(data) if end is None else end
    for _ in range(MOST_BOXES):
        if at + 8 > end:
            return
        box = _box(data[at : at + 16], at, end)
        if box[2] > end:
            raise ValueError(f"a box of {box[2] - at} bytes in {end - at}")
        yield box
        at = box[2]
    raise ValueError(f"more than {MOST_BOXES} boxes")


def _box(head: bytes, at: int, end: int) -> Box:
    length, kind = struct.unpack_from(">I4s", head)
    skip = 8
    if length == 1:
        length, skip = struct.unpack_from(">Q", head, 8)[0], 16
    elif length == 0:
        length = end - at
    if length < skip:
        raise ValueError(f"a box of {length} bytes")
    return kind, at + skip, at + length


def _child(data: bytes, box: Box | None, *path: bytes) -> Box | None:
    """The first box at `path` within a box."""
    for kind in path:
        if box is None:
            return None
        box = next((b for b in _inside(data, box[1], box[2]) if b[0] == kind), None)
    return box


def _movie(data: bytes) -> Stated:
    stated, whole = Stated(), (b"moov", 0, len(data))
    header = _child(data, whole, b"mvhd")
    units = 0
    if header is not None:
        long = data[header[1]] == 1
        units = struct.unpack_from(">I", data, header[1] + (20 if long else 12))[0]
    stated.focal_35mm = _lens(data, whole)
    for box in _inside(data):
        if box[0] == b"trak":
            handler = _child(data, box, b"mdia", b"hdlr")
            kind = "" if handler is None else data[handler[1] + 8 : handler[1] + 12].decode("latin-1")
            if kind == "vide" and "vide" not in stated.kinds:
                _track(data, box, units, stated)
            stated.kinds.append(kind)
    return stated


def _track(data: bytes, track: Box, units: int, stated: Stated) -> None:
    header = _child(data, track, b"tkhd")
    if header is not None:
        at = header[1] + (52 if data[header[1]] == 1 else 40)
        stated.rotation, stated.mirrored = _upright(struct.unpack_from(">9i", data, at))
    media = _child(data, track, b"mdia", b"mdhd")
    scale = 0
    if media is not None:
        scale = struct.unpack_from(">I", data, media[1] + (20 if data[media[1]] == 1 else 12))[0]
    table = _child(data, track, b"mdia", b"minf", b"stbl")
    _times(data, _child(data, table, b"stts"), scale, stated)
    _entry(data, _child(data, table, b"stsd"), stated)
    edits = _child(data, track, b"edts", b"elst")
    if edits is not None and units and stated.seconds:
        stated.seconds = min(stated.seconds, _shown(data, edits) / units) or stated.seconds
    stated.focal_35mm = _lens(data, track) or stated.focal_35mm


def _upright(matrix: tuple[int, ...]) -> tuple[int, bool]:
    """Clockwise degrees of a track's matrix, and whether it changes left and right after them."""
    a, b, c, d = (matrix[k] / 65536 for k in (0, 1, 3, 4))
    mirrored = a * d - b * c < 0
    if mirrored:
        a, c = -a, -c
    size = max(abs(a), abs(b))
    if not size or min(abs(a), abs(b)) > WRONG_ANGLE * size:
        return 0, mirrored  # no quarter turn: players pass it over, too
    return ((0 if a > 0 else 180) if abs(a) > abs(b) else (90 if b > 0 else 270)), mirrored


def _times(data: bytes, box: Box | None, scale: int, stated: Stated) -> None:
    if box is None or not scale:
        return
    count = min(struct.unpack_from(">I", data, box[1] + 4)[0], (box[2] - box[1] - 8) // 8)
    runs = list(struct.iter_unpack(">II", data[box[1] + 8 : box[1] + 8 + 8 * count]))
    samples, units = sum(n for n, _ in runs), sum(n * step for n, step in runs)
    stated.seconds = units / scale
    stated.fps = samples * scale / units if units else 0.0
    lengths: dict[int, int] = {}
    for n, step in runs:
        lengths[step] = lengths.get(step, 0) + n
    # Two lengths that differ by one unit are one rate that the clock cannot say (30 a second in thousandths).
    usual = max(lengths, key=lambda step: lengths[step], default=0)
    alike = sum(n for step, n in lengths.items() if abs(step - usual) <= 1)
    stated.constant = alike >= USUAL_STEP * samples - 1


def _shown(data: bytes, box: Box) -> int:
    """The length of an edit list, without empty edits."""
    count = struct.unpack_from(">I", data, box[1] + 4)[0]
    form = ">QqI" if data[box[1]] == 1 else ">IiI"
    step = struct.calcsize(form)
    count = min(count, (box[2] - box[1] - 8) // step)
    edits = [struct.unpack_from(form, data, box[1] + 8 + k * step) for k in range(count)]
    return sum(length for length, start, _ in edits if start >= 0)


def _entry(data: bytes, box: Box | None, stated: Stated) -> None:
    """The first sample entry: codec, size, and the transfer function of its `colr`."""
    first = next(_inside(data, box[1] + 8, box[2]), None) if box is not None else None
    if first is None:
        return
    stated.codec = first[0].decode("latin-1")
    stated.width, stated.height = struct.unpack_from(">HH", data, first[1] + 24)
    for kind, start, end in _inside(data, first[1] + 78, first[2]):
        if kind == b"colr" and data[start : start + 4] in (b"nclx", b"nclc") and end - start >= 10:
            code = struct.unpack_from(">H", data, start + 6)[0]
            stated.transfer = TRANSFERS.get(code, "sdr")


def _lens(data: bytes, box: Box) -> float | None:
    """The stated focal length of a 35 mm picture, from QuickTime's metadata of a film or a track."""
    meta = _child(data, box, b"meta")
    if meta is not None and data[meta[1] + 4 : meta[1] + 8] != b"hdlr":  # in MP4 a version stands before it
        meta = (meta[0], meta[1] + 4, meta[2])
    keys, items = _child(data, meta, b"keys"), _child(data, meta, b"ilst")
    if keys is None or items is None:
        return None
    names = [data[start:end] for _, start, end in _inside(data, keys[1] + 8, keys[2])]
    for kind, start, end in _inside(data, items[1], items[2]):
        number = int.from_bytes(kind)
        if 0 < number <= len(names) and names[number - 1] == LENS:
            value = _child(data, (kind, start, end), b"data")
            return None if value is None else _number(data[value[1] : value[2]])
    return None


def _number(value: bytes) -> float | None:
    """A number of QuickTime's metadata: its type, its country, itself."""
    kind, rest = int.from_bytes(value[:4]), value[8:]
    form = NUMBERS.get(kind)
    try:
        if form in ("int", "unsigned"):
            found = float(int.from_bytes(rest, signed=form == "int"))
        else:
            found = float(rest.decode("ascii") if form is None else struct.unpack_from(form, rest)[0])
    except (ValueError, struct.error):
        return None
    return found if 1 <= found <= 1000 else None


def _begins(head: bytes, magic: bytes) -> bool:
    """Whether the bytes match; a dot is any byte."""
    return len(head) >= len(magic) and all(a == b or b == 0x2E for a, b in zip(head, magic, strict=False))
