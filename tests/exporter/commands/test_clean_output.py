"""Names in files of others reach a terminal cleaned: it obeys nothing in them, and nothing in them hides."""

from __future__ import annotations

import json
import unicodedata
from dataclasses import replace
from pathlib import Path

import pytest

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


def test_json_holds_the_names_as_escapes(run: Run, hostile: Path) -> None:
    code, out, _ = run("inspect", hostile, "--json")
    assert code == 0
    assert_plain(out)
    assert json.loads(out)["name"] == HOSTILE
    assert "\\u202e" in out and "\\u009b" in out and "Ä" not in out


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


def test_what_is_wrong_with_such_a_bundle_is_one_line_each(run: Run, hostile: Path, tmp_path: Path) -> None:
    """A line end in a name could else forge a line of its own."""
    avatar = replace(full_avatar(), name="x")
    face = replace(avatar.expressions[0], name="\nerror: forged", aliases=("twice",))
    again = replace(avatar.expressions[1], aliases=("twice",))
    forged = replace(
        avatar,
        expressions=(face, again, *avatar.expressions[2:]),
        driving=replace(avatar.driving, outputs=("expression/exp_003",), matrix=avatar.driving.matrix[:1]),
    )
    bundle = bundles.write(tmp_path / "forged", forged)
    code, out, _ = run("validate", bundle)
    assert code == 1 and len(out.splitlines()) == 1
    assert "alias of" in out
