"""What commands print: names in files of others are cleaned, and what a message advises is an option of the command."""

from __future__ import annotations

import json
import re
import unicodedata
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from avatar_export import cli
from avatar_export.commands.program import parser_of
from tests import bundles
from tests.avatars import full_avatar
from tests.commands import Run

# A C0 escape that clears the screen, its C1 form, a line end, an override of the writing direction.
HOSTILE = "a\x1b[2J\x9b2J\nb\u202ec\u2066"
CLEANED = "a?[2J?2J?b?c?"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle with such names wherever a name may stand."""
    avatar = full_avatar()
    first, *groups = avatar.groups
    clip, *clips = avatar.clips
    expression, *expressions = avatar.expressions
    named = replace(
        avatar,
        name=HOSTILE,
        groups=(replace(first, name=HOSTILE), *groups),
        clips=(replace(clip, name=HOSTILE), *clips),
        expressions=(replace(expression, name=HOSTILE), *expressions),
        driving=replace(avatar.driving, outputs=(f"expression/{HOSTILE}", *avatar.driving.outputs[1:])),
        provenance={"system": "made_for_tests", HOSTILE: {HOSTILE: HOSTILE}},
    )
    return bundles.write(tmp_path_factory.mktemp("hostile") / "bundle", named)


def assert_plain(text: str) -> None:
    """Beside line ends, no character of Unicode's categories C: controls, formats, surrogates, unassigned."""
    assert {c for c in text if unicodedata.category(c).startswith("C")} <= {"\n"}


def test_inspect_shows_cleaned_names(run: Run, hostile: Path) -> None:
    code, out, err = run("inspect", hostile)
    assert (code, err) == (0, "")
    assert_plain(out)
    for label in ("groups", "clips", "provenance"):
        assert f"{label}.{CLEANED} " in out, label
    assert ["name", CLEANED] in [line.split() for line in out.splitlines()]
    code, out, _ = run("inspect", hostile, "--json")
    assert_plain(out)
    assert json.loads(out)["name"] == HOSTILE and "Ä" not in out


@pytest.mark.parametrize(
    "command",
    [
        ("validate", "{}"),
        ("validate", "{}", "--json"),
        ("render", "{}", "-o", "{}.png", "-e", HOSTILE + "=1", "--size", "16"),
        ("render", "{}", "-o", "{}.png", "-e", "none=1", "--size", "16"),
        ("render", "{}", "-o", "{}.webp", "--clip", "none", "--size", "16"),
        ("pose", "{}", "-o", "{}.json", "-j", "none=1,0,0"),
        ("conform", "{}"),
    ],
    ids=lambda command: " ".join(command[:1]),
)
def test_no_command_passes_them_on(run: Run, hostile: Path, command: tuple[str, ...]) -> None:
    _, out, err = run(*(part.replace("{}", str(hostile)) for part in command))
    assert out or err
    assert_plain(out + err)


def parser(command: str) -> Any:
    return parser_of(cli.app).commands[command]


def options(command: str) -> set[str]:
    return {option for parameter in parser(command).params for option in parameter.opts}


@pytest.mark.parametrize(
    "words", [("view", "--no-open"), ("publish", "-o", "site"), ("pack", "-o", "x.avatar")]
)
def test_of_a_checkpoint_without_its_inputs_pack_is_named(
    run: Run, sample_blendshapes: Path, words: tuple[str, ...]
) -> None:
    code, out, error = run(words[0], sample_blendshapes / "model", *words[1:])
    assert (code, out) == (2, "")
    named = set(re.findall("--[a-z-]+", error.splitlines()[-1]))
    assert named and named <= options("pack")
    assert ("`avatar-export pack`" in error) == (not named <= options(words[0]))
