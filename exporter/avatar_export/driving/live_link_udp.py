"""Recorded Live Link Face packets (version 6): the UDP packets of the app, stored in a file.

The recording, plain or gzipped, all integers big-endian: u8 protocol version (6), u32 number of packets, then
for each a u32 length and the packet. A packet: u8 version (6); device id and subject name, each a u32 length
and UTF-8 text; frame number i32, sub-frame f32, frame rate as numerator i32 and denominator i32; then, if a
face was seen, u8 count (61) and 61 f32 in the order of arkit.CHANNELS (52 weights, nine angles in radians).
The layout was found from a recording of 180 packets of 320 bytes, in which every byte is accounted for.
"""

from __future__ import annotations

import gzip
import io
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from avatar_export.driving.frames import DrivingTake, take
from avatar_runtime.avatar import F64
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError

VERSION = 6
GZIP_MAGIC = b"\x1f\x8b"
MAX_BYTES = 64 << 20  # unpacked: 57 minutes at 60 fps
MAX_TEXT = 1024  # bytes of a device id or subject name

_COUNT = struct.Struct(">BI")
_LENGTH = struct.Struct(">I")
_FRAME_TIME = struct.Struct(">ifii")
_CHANNELS = struct.Struct(f">{len(CHANNELS)}f")


@dataclass(frozen=True)
class Packet:
    """One packet; `channels` is None where no face was seen."""

    device: str
    subject: str
    time: float  # seconds by the sender's frame count
    channels: F64 | None  # [61]


def is_live_link_udp(data: bytes) -> bool:
    """Whether `data` begins as a recording of packets does, plain or gzipped."""
    return data[:2] == GZIP_MAGIC or (len(data) >= _COUNT.size and data[0] == VERSION)


def read_live_link_udp(data: bytes, source: str) -> DrivingTake:
    """The take in a recording of packets, in order of time; AvatarError names the packet (from 0).

    UDP may swap or repeat packets: they are sorted by time and repeats left out. Packets of two devices or
    subjects are refused. Packets without a face are left out and counted in `without_face`.
    """
    data = _unpacked(data, source)
    if len(data) < _COUNT.size or data[0] != VERSION:
        raise AvatarError(f"is not a recording of Live Link Face packets of version {VERSION}", file=source)
    packets = _packets(data, source)
    senders = sorted({(p.device, p.subject) for p in packets})
    if len(senders) > 1:
        raise AvatarError(
            f"holds packets of {len(senders)} devices or subjects, expected one: {senders[:4]}", file=source
        )
    seen = [(p.time, p.channels) for p in packets if p.channels is not None]
    time = np.array([t for t, _ in seen])
    _, order = np.unique(time, return_index=True)
    channels = np.array([c for _, c in seen]).reshape(-1, len(CHANNELS))
    return take(time[order], channels[order], source, without_face=len(packets) - len(seen))


def _unpacked(data: bytes, source: str) -> bytes:
    if data[:2] != GZIP_MAGIC:
        return data
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
            plain = stream.read(MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise AvatarError(f"is a damaged gzip file: {error}", file=source) from None
    if len(plain) > MAX_BYTES:
        raise AvatarError(f"unpacks to more than {MAX_BYTES >> 20} MiB", file=source)
    return plain


def _packets(data: bytes, source: str) -> list[Packet]:
    count = _COUNT.unpack_from(data)[1]
    smallest = _LENGTH.size * 3 + 1 + _FRAME_TIME.size
    if count * smallest > len(data):
        raise AvatarError(f"announces {count} packets, but holds only {len(data)} bytes", file=source)
    packets, at = [], _COUNT.size
    for number in range(count):
        if at + _LENGTH.size > len(data):
            raise AvatarError(f"ends before packet {number} of {count}", file=source)
        (size,) = _LENGTH.unpack_from(data, at)
        at += _LENGTH.size
        if size > len(data) - at:
            raise AvatarError(
                f"packet {number}: announces {size} bytes, but {len(data) - at} are left", file=source
            )
        packets.append(parse_packet(data[at : at + size], source=source, number=number))
        at += size
    if at != len(data):
        raise AvatarError(f"has {len(data) - at} bytes after packet {count - 1}", file=source)
    return packets


def parse_packet(data: bytes, *, source: str = "packet", number: int = 0) -> Packet:
    """One UDP packet. Raises AvatarError, naming packet `number` of `source`, unless every byte is understood."""

    def wrong(what: str) -> AvatarError:
        return AvatarError(f"packet {number}: {what}", file=source)

    if not data or data[0] != VERSION:
        raise wrong(f"version {data[0] if data else 'none'}, expected {VERSION}")
    at, texts = 1, []
    for what in ("device id", "subject name"):
        if at + _LENGTH.size > len(data):
            raise wrong(f"ends before its {what}")
        (length,) = _LENGTH.unpack_from(data, at)
        at += _LENGTH.size
        if length > min(MAX_TEXT, len(data) - at):
            raise wrong(f"{what} of {length} bytes is too long")
        try:
            texts.append(data[at : at + length].decode())
        except UnicodeDecodeError:
            raise wrong(f"{what} is not UTF-8 text") from None
        at += length
    if at + _FRAME_TIME.size > len(data):
        raise wrong("ends before its frame time")
    frame, sub_frame, rate, per = _FRAME_TIME.unpack_from(data, at)
    if rate <= 0 or per <= 0 or not np.isfinite(sub_frame):
        raise wrong(f"frame time {frame} + {sub_frame} at {rate}/{per} frames per second is invalid")
    channels = _channels(data[at + _FRAME_TIME.size :], wrong)
    return Packet(texts[0], texts[1], (frame + sub_frame) * per / rate, channels)


def _channels(body: bytes, wrong: Callable[[str], AvatarError]) -> F64 | None:
    if not body or body == b"\0":
        return None
    if body[0] != len(CHANNELS) or len(body) != 1 + _CHANNELS.size:
        raise wrong(f"{body[0]} channels in {len(body) - 1} bytes, expected {len(CHANNELS)}")
    return np.array(_CHANNELS.unpack_from(body, 1))
