"""Types and values of command line options; a wrong value raises typer.BadParameter, a usage error with exit code 2."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from avatar_export.clips.doubts import unmoved
from avatar_export.notes.note import Note, fact
from avatar_export.options import Options, option
from avatar_export.playing.sequences import pose_of
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import BACKENDS
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the output if it exists.")]
Bundle = Annotated[Path, typer.Argument(help="A bundle folder, .avatar.zip, or pack NAME.avatar.")]
Backend = Annotated[
    str | None,
    typer.Option(
        help=f"Backend that computes: {', '.join(BACKENDS)}. Default: cpu if Numba is installed, else reference.",
        metavar="NAME",
    ),
]
NUMBER = re.compile("[0-9]{1,6}")
LARGEST = 1e6  # larger weights and degrees are refused as typing errors


def pairs(values: Sequence[str] | None, option: str) -> list[tuple[str, str]]:
    """NAME=VALUE options as (name, value). Raises AvatarError, which names the `option`."""
    pairs = []
    for value in values or []:
        name, equals, text = value.rpartition("=")
        if not equals or not name:
            raise AvatarError(f"{value[:80]!a} is not NAME=VALUE", field=option)
        pairs.append((name, text))
    return pairs


def numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    """Exactly `count` finite numbers between commas; a usage error names the `option`."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(abs(number) <= LARGEST for number in numbers):
        raise typer.BadParameter(
            f"{text!r} is not {count} finite number{'s' * (count > 1)} up to {LARGEST:g}", param_hint=option
        )
    return numbers


def size(text: str) -> tuple[int, int]:
    """(width, height) from N or WxH."""
    width, by, height = text.partition("x")
    if not (NUMBER.fullmatch(width) and (not by or NUMBER.fullmatch(height))):
        raise typer.BadParameter(f"{text!r} is not N or WxH", param_hint="--size")
    size = int(width), int(height or width)
    if not all(1 <= side <= 8192 for side in size):
        raise typer.BadParameter("each side is 1 to 8192 pixels", param_hint="--size")
    return size


def frame_slice(text: str | None, option: str = "--frames") -> slice:
    """The frames FIRST:END of an `option`; both numbers are optional, None means all frames."""
    if text is None:
        return slice(None)
    first, colon, end = text.partition(":")
    if not colon or not all(part == "" or NUMBER.fullmatch(part) for part in (first, end)):
        raise typer.BadParameter(f"{text!r} is not FIRST:END", param_hint=option)
    return slice(int(first or 0), int(end) if end else None)


def background(text: str | None) -> tuple[float, float, float] | None:
    """The colour R,G,B; None for `transparent`, and without the option (the training background)."""
    if text is None or text == "transparent":
        return None
    r, g, b = numbers(text, 3, "--background")
    if not all(0 <= value <= 1 for value in (r, g, b)):
        raise typer.BadParameter(f"{text!r} is not three numbers from 0 to 1", param_hint="--background")
    return r, g, b


def one_of(option: str, value: object, known: Collection[object]) -> None:
    """Raise a usage error unless the value of an option is one of `known`, or None."""
    if value is not None and value not in known:
        raise typer.BadParameter(f"{value!r} is not one of {', '.join(map(str, known))}", param_hint=option)


def exclude(given: Mapping[str, object]) -> None:
    """Raise a usage error if more than one of these is given."""
    named = [name for name, value in given.items() if value]
    if len(named) > 1:
        raise typer.BadParameter(f"{' and '.join(named)} cannot be used together")


@dataclass(frozen=True)
class Posed(Options):
    """A pose, in options NAME=VALUE."""

    expression: tuple[str, ...] = option(
        (), "NAME=WEIGHT of one of the avatar's expressions. May be repeated.", ("--expression", "-e")
    )
    arkit: tuple[str, ...] = option(
        (), "NAME=WEIGHT of an ARKit shape, through the avatar's driving. May be repeated.", ("--arkit", "-a")
    )
    joint: tuple[str, ...] = option(
        (), "NAME=X,Y,Z: rotation vector of a joint, in degrees. May be repeated.", ("--joint", "-j")
    )
    eyelid: tuple[str, ...] = option((), "NAME=WEIGHT of an eyelid. May be repeated.")

    @property
    def given(self) -> bool:
        """Whether there is one."""
        return self != Posed()

    def pose(self, avatar: Avatar) -> Pose:
        """The pose of `avatar`. Raises AvatarError as `pose_of`."""
        turns = {name: numbers(value, 3, "--joint / -j") for name, value in pairs(self.joint, "--joint / -j")}
        weights = [
            {name: numbers(value, 1, option)[0] for name, value in pairs(given, option)}
            for given, option in (
                (self.expression, "--expression / -e"),
                (self.arkit, "--arkit / -a"),
                (self.eyelid, "--eyelid"),
            )
        ]
        return pose_of(avatar, weights[0], weights[1], turns, weights[2])

    def notes(self, avatar: Avatar) -> list[Note]:
        """What an ARKit weight of a sound pose cannot move here."""
        named = [canonical(name) or name for name, _ in pairs(self.arkit, "--arkit / -a")]
        still = unmoved(avatar, named) if named else []
        return [fact("unmoved", names=still)] if still else []
