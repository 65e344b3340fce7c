"""VMC, a protocol of virtual performers over OSC and UDP: blendshapes with ARKit names, and the head's rotation.

Of its messages three count: `/VMC/Ext/Blend/Val` name value sets a weight, `/VMC/Ext/Blend/Apply` ends a frame,
`/VMC/Ext/Bone/Pos` name px py pz qx qy qz qw turns a bone. Bones are those of Unity's humanoid: left-handed, +X the
subject's right, +Z out of the face. Mesh axes have +X the subject's left, so the rotation is mirrored. The rotation of
the head is that of the neck times that of the head; turns of the spine are not part of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pythonosc.osc_packet import OscPacket

from avatar_export.live.inbox import Inbox
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS, canonical
from avatar_runtime.driving.axes import HEAD_SIGNS
from avatar_runtime.rotation import quat_multiply

VALUE, APPLY, BONE = "/VMC/Ext/Blend/Val", "/VMC/Ext/Blend/Apply", "/VMC/Ext/Bone/Pos"
HEAD = CHANNELS.index("headYaw")
TURNED = ("Neck", "Head")  # from the body outwards
Quaternion = tuple[float, float, float, float]  # w, x, y, z
STILL: Quaternion = (1.0, 0.0, 0.0, 0.0)
PATIENCE = 300  # applied frames without an ARKit name, after which a line says so


class VmcReader:
    """Collects messages until a frame is whole, then gives it to an inbox."""

    def __init__(self, inbox: Inbox) -> None:
        self._inbox = inbox
        self._weights = [0.0] * len(ARKIT_NAMES)
        self._turns = dict.fromkeys(TURNED, STILL)
        self._seen = False  # whether an ARKit name ever came
        self._foreign = 0  # frames before that

    def packet(self, data: bytes, sender: str) -> None:
        """One UDP packet: a message or a bundle of them."""
        name = f"VMC at {sender}"
        try:
            messages = [(m.message.address, m.message.params) for m in OscPacket(data).messages]
        except Exception:  # the library raises many kinds on a stranger's bytes
            self._inbox.refuse(name, "it is not OSC")
            return
        for address, values in messages:
            if address == VALUE:
                self._value(values, name)
            elif address == BONE:
                self._bone(values, name)
            elif address == APPLY:
                self._apply(name)

    def _value(self, values: list[object], sender: str) -> None:
        match values:
            case [str(name), float() | int() as weight] if math.isfinite(weight):
                known = canonical(name)
                if known is not None:
                    self._weights[ARKIT_NAMES.index(known)] = float(weight)
                    self._seen = True
            case _:
                self._inbox.refuse(sender, f"{VALUE} needs a name and a number")

    def _bone(self, values: list[object], sender: str) -> None:
        match values:
            case [str(name), *numbers] if len(numbers) == 7:
                if name not in TURNED:
                    return
                x, y, z, w = (float(n) if isinstance(n, float | int) else math.nan for n in numbers[3:])
                size = math.sqrt(w * w + x * x + y * y + z * z)
                if 0 < size < math.inf:
                    self._turns[name] = (w / size, x / size, -y / size, -z / size)  # mirrored in x
                    return
        self._inbox.refuse(sender, f"{BONE} needs a name, a position and a quaternion")

    def _apply(self, sender: str) -> None:
        if not self._seen:
            self._foreign += 1
            if self._foreign % PATIENCE == 1:
                self._inbox.refuse(sender, "no blendshape has an ARKit name; let the sender send all 52")
            return
        turn = np.array(STILL)
        for name in TURNED:
            turn = quat_multiply(turn, np.array(self._turns[name]))
        channels = [*self._weights, *([0.0] * (len(CHANNELS) - HEAD))]
        channels[HEAD : HEAD + 3] = head_channels(turn.tolist())
        self._inbox.frame(sender, channels)


def head_channels(turn: Sequence[float]) -> tuple[float, float, float]:
    """headYaw, headPitch and headRoll, radians, of a rotation wxyz in mesh axes: Ry Rx Rz of their signed values."""
    w, x, y, z = turn
    yaw = math.atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y))
    pitch = math.asin(min(1.0, max(-1.0, 2 * (w * x - y * z))))
    roll = math.atan2(2 * (x * y + w * z), 1 - 2 * (x * x + z * z))
    return HEAD_SIGNS[0] * yaw, HEAD_SIGNS[1] * pitch, HEAD_SIGNS[2] * roll
