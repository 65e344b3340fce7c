"""Python refuses the packs that every player refuses, in one line, and takes the unusual ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import decode_pack
from tests.players.hostile.packs import changed, sound, unsound

GOLDEN = Path(__file__).parents[2] / "data" / "packs" / "1.0"
FILES = {path.stem: path.read_bytes() for path in GOLDEN.glob("*.avatar")}


@pytest.mark.parametrize(("file", "said"), [pytest.param(f, s, id=w) for w, f, s in unsound(FILES)])
def test_what_every_player_refuses_is_refused_in_one_line(file: bytes, said: dict[str, str]) -> None:
    with pytest.raises(AvatarError) as caught:
        decode_pack(file, "some.avatar")
    line = str(caught.value)
    assert line.startswith(f"some.avatar: {said.get('python', said.get('field', ''))}") and "\n" not in line


def test_what_every_player_takes_is_taken() -> None:
    for file in sound(FILES).values():
        decode_pack(file, "some.avatar")


def test_an_unknown_rule_is_refused() -> None:
    """Players follow the program instead."""
    file = changed(FILES["surface"], lambda document: document["avatar"]["rules"].update(rotation="twist"))
    with pytest.raises(AvatarError, match="'twist' is unknown to this reader"):
        decode_pack(file, "x")
