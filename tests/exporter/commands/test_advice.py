"""What a message advises is an option of the command, or the message says of which one."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from avatar_export import cli
from avatar_export.commands.program import parser_of
from avatar_runtime.io.errors import AvatarError
from tests.commands import Run

COMMANDS = [command.__name__ for command in cli.COMMANDS]


def parser(command: str) -> Any:
    return parser_of(cli.app).commands[command]


def options(command: str) -> set[str]:
    return {option for parameter in parser(command).params for option in parameter.opts}


def test_view_of_a_checkpoint_without_its_inputs_names_pack(
    run: Run, sample_blendshapes: Path, tmp_path: Path
) -> None:
    """Found by a user: `view` advised --rig and --no-rig."""
    for words in (
        ("view", "--no-open"),
        ("publish", "-o", tmp_path / "site"),
        ("pack", "-o", tmp_path / "x.avatar"),
    ):
        code, out, error = run(words[0], sample_blendshapes / "model", *words[1:])
        assert (code, out) == (2, "")
        error = error.splitlines()[-1]
        named = set(re.findall("--[a-z-]+", error))
        assert named and (named <= options(words[0]) or named <= options("pack"))
        assert (f"`{words[0]}` has no --" in error) == (not named <= options(words[0]))
        assert (
            words[0] == "pack" or f"run `avatar-export pack` with them first, and give `{words[0]}`" in error
        )


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("text", "lacked"),
    [
        ("needs a mesh; pass --mesh", "--mesh"),
        ("a pack/convert: pass --shape and --dataset", "--shape, --dataset"),
        ("convert it again with --rig", ""),
        ("run `avatar-export convert` with --rig", ""),
        ("pass --no-such-option", ""),
        ("exists; pass --help", ""),
        ("is named a--mesh", ""),
    ],
)
def test_every_command_is_completed(
    run: Run, monkeypatch: pytest.MonkeyPatch, command: str, text: str, lacked: str
) -> None:
    def fails(_: object) -> None:
        raise AvatarError(text)

    monkeypatch.setattr(parser(command), "invoke", fails)
    monkeypatch.setattr(parser(command), "parse_args", lambda *_: [])
    _, _, error = run(command)
    missing = [option for option in re.findall("--[a-z-]+", lacked) if option not in options(command)]
    if not missing:
        assert error == f"avatar-export: {text}\n"
        return
    them = "it" if len(missing) == 1 else "them"
    said = f"`{command}` has no {', '.join(missing)}: run `avatar-export pack` with {them} first"
    assert error == f"avatar-export: {text}; {said}, and give `{command}` what it writes\n"
