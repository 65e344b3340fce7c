"""Where the hand-written files of the players are: in a checkout, or in an installed package."""

from __future__ import annotations

from contextlib import suppress
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

_CHECKOUT = Path(__file__).parents[3] / "players"
_PACKAGED = Path(__file__).parent / "files"  # that wheels hold


def folder(player: str) -> Path:
    """The folder of the hand-written files of `player`. Raises FileNotFoundError if this install has none."""
    for root in (_CHECKOUT, _PACKAGED):
        if (root / player).is_dir():
            return root / player
    raise FileNotFoundError(f"this installation has no files of the {player} player")


def license_text() -> bytes:
    """The licence of all players. Raises FileNotFoundError if this install has none."""
    if (_CHECKOUT.parent / "LICENSE").is_file():
        return (_CHECKOUT.parent / "LICENSE").read_bytes()
    with suppress(PackageNotFoundError):
        text = distribution("avatar-export").read_text("licenses/LICENSE")
        if text is not None:
            return text.encode()
    raise FileNotFoundError("this installation has no LICENSE")
