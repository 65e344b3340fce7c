"""The npm package as a web developer has it: strict pages, types, Node, and the recipes of its README."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.players.web import WEB, environment_of, in_browsers, run_node_test
from tests.session.needed import need

INSTALLED = WEB / "examples" / "node_modules"  # Vite, React, three.js, an old TypeScript: `make test-more`


def installed() -> None:
    need({"players/web/examples/node_modules (npm ci)": INSTALLED.exists()})


@in_browsers
def test_strict_pages_show_it_or_say_what_they_forbid(browser: str, web_package: Path) -> None:
    run_node_test("package/strict.test.mjs", environment_of(browser), AVATAR_PACKAGE=str(web_package))


def test_node_is_told_that_it_is_no_browser(web_package: Path) -> None:
    run_node_test("package/node.test.mjs", AVATAR_PACKAGE=str(web_package))


def test_its_types_are_sound(web_package: Path) -> None:
    run_node_test("package/types.test.mjs", AVATAR_PACKAGE=str(web_package))


@pytest.mark.more
def test_its_types_are_sound_for_typescript_5_4(web_package: Path) -> None:
    installed()
    old = {"TYPESCRIPT": str(INSTALLED / "typescript-5.4")}
    run_node_test("package/types.test.mjs", AVATAR_PACKAGE=str(web_package), **old)


@pytest.mark.more
def test_the_recipes_show_an_avatar(web_package: Path) -> None:
    installed()
    run_node_test("package/recipes.test.mjs", environment_of("chromium"), AVATAR_PACKAGE=str(web_package))
