"""What an avatar is read from must be in its program, or is named."""

from __future__ import annotations

from dataclasses import replace

import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.bake import bake
from avatar_runtime.program.model import Program
from avatar_runtime.program.read import Columns, read_level
from tests.avatars import surface_avatar

NAMED = {"a section": ("SurfaceStatic", "corners", "buffer SurfaceStatic, corners: is missing")}


def without(program: Program, buffer: str, section: str | None) -> Program:
    """The program without a buffer, or without a section of it."""
    buffers = dict(program.buffers)
    held = buffers.pop(buffer)
    if section is not None:
        kept = tuple(one for one in held.sections if one.name != section)
        buffers[buffer] = replace(held, sections=kept)
    return replace(program, buffers=buffers)


def read(program: Program, avatar: Avatar) -> None:
    """Its finest level."""
    joints = 0 if avatar.rig is None else avatar.rig.joint_count
    columns = Columns(len(avatar.expressions), 0, len(avatar.eyelids), joints)
    read_level(program, 0, columns, avatar.rules.position or "")


@pytest.mark.parametrize("what", NAMED)
def test_what_is_missing_is_named(what: str) -> None:
    avatar = surface_avatar(3)
    program = bake(avatar)
    read(program, avatar)
    buffer, section, message = NAMED[what]
    with pytest.raises(AvatarError, match=message):
        read(without(program, buffer, section), avatar)
