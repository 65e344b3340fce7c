"""What programs send to a live view: packets of the recorded Live Link Face take, and of VMC."""

from __future__ import annotations

import gzip
import struct
from collections.abc import Mapping

from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from tests.runtime.driving.recordings import UDP, recording


def live_link_packets() -> list[bytes]:
    """The packets of the recording, in order."""
    data = recording(UDP).read_bytes()
    data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    at, found = 5, []
    for _ in range(struct.unpack_from(">I", data, 1)[0]):
        (size,) = struct.unpack_from(">I", data, at)
        found.append(data[at + 4 : at + 4 + size])
        at += 4 + size
    return found


def osc(address: str, *values: str | float) -> bytes:
    """One OSC message."""
    builder = OscMessageBuilder(address)
    for value in values:
        builder.add_arg(value)
    return builder.build().dgram


def vmc_bundle(weights: Mapping[str, float], bones: Mapping[str, tuple[float, ...]]) -> bytes:
    """A frame of VMC as one bundle; bones are quaternions x, y, z, w of Unity."""
    bundle = OscBundleBuilder(IMMEDIATELY)
    messages: list[tuple[str, tuple[str | float, ...]]] = [("/VMC/Ext/OK", (1,))]
    messages += [("/VMC/Ext/Bone/Pos", (name, 0.0, 0.0, 0.0, *turn)) for name, turn in bones.items()]
    messages += [("/VMC/Ext/Blend/Val", item) for item in weights.items()]
    messages += [("/VMC/Ext/Blend/Apply", ())]
    for address, values in messages:
        builder = OscMessageBuilder(address)
        for value in values:
            builder.add_arg(value)
        bundle.add_content(builder.build())
    return bundle.build().dgram
