"""The 52 ARKit blendshape names and the nine rotation channels that Live Link Face sends after them.

Names, never indices: every tool has its own order. Canonical here are ARKit's lowerCamelCase names in the
order of a Live Link Face packet. Left and right are the subject's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

ARKIT_NAMES: tuple[str, ...] = (
    "eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeSquintLeft",
    "eyeWideLeft", "eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight",
    "eyeSquintRight", "eyeWideRight", "jawForward", "jawRight", "jawLeft", "jawOpen", "mouthClose",
    "mouthFunnel", "mouthPucker", "mouthRight", "mouthLeft", "mouthSmileLeft", "mouthSmileRight",
    "mouthFrownLeft", "mouthFrownRight", "mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft",
    "mouthStretchRight", "mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper",
    "mouthPressLeft", "mouthPressRight", "mouthLowerDownLeft", "mouthLowerDownRight", "mouthUpperUpLeft",
    "mouthUpperUpRight", "browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft",
    "browOuterUpRight", "cheekPuff", "cheekSquintLeft", "cheekSquintRight", "noseSneerLeft",
    "noseSneerRight", "tongueOut",
)  # fmt: skip

ROTATION_CHANNELS: tuple[str, ...] = tuple(
    part + angle for part in ("head", "leftEye", "rightEye") for angle in ("Yaw", "Pitch", "Roll")
)

CHANNELS: tuple[str, ...] = ARKIT_NAMES + ROTATION_CHANNELS

# Some bases split an ARKit shape into a left and a right half; one input drives both.
_HALVES = ("browInnerUp", "cheekPuff")

_PREFIX = re.compile(r"^(ak_\d+|arkit|bs)_")


def _spellings() -> dict[str, str]:
    """Spelling (lower case, letters only) -> canonical name: the name itself and the `_L`/`_R` form."""
    table = {name.lower(): name for name in CHANNELS}
    for name in ARKIT_NAMES:
        for side in ("Left", "Right"):
            if name.endswith(side):
                table[(name.removesuffix(side) + side[0]).lower()] = name
    for whole in _HALVES:
        for side in ("l", "r", "left", "right"):
            table[whole.lower() + side] = whole
    return table


_SPELLINGS = _spellings()


def canonical(name: str) -> str | None:
    """The ARKit name that `name` spells, or None.

    Accepted: lowerCamelCase, PascalCase or any other case (`EyeBlinkLeft`), ARKit's raw values and ICT's
    (`eyeBlink_L`), underscores (`eye_blink_left`), node and tool prefixes (`BS_node.eyeBlinkLeft`,
    `head|eyeBlinkLeft`, `AK_01_EyeBlinkLeft`), and the halves of browInnerUp and cheekPuff (`cheekPuff_L`).
    """
    found = _lookup(name)
    return found if found in ARKIT_NAMES else None


def first_canonical(names: Iterable[str]) -> str | None:
    """The ARKit name of the first of `names` that has one, or None."""
    return next((found for found in map(canonical, names) if found), None)


def rotation_channel(name: str) -> str | None:
    """The rotation channel (`headYaw` ... `rightEyeRoll`) that `name` spells, or None."""
    found = _lookup(name)
    return found if found in ROTATION_CHANNELS else None


def _lookup(name: str) -> str | None:
    last = _PREFIX.sub("", re.split(r"[.:|/]", name.strip())[-1].lower())
    return _SPELLINGS.get(re.sub(r"[_\- ]", "", last))
