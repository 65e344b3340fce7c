"""The libraries, and the table of the engine's functions that they are built with."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from tools.godot import build, interface

from tests.players.godot import engine


def test_the_library_shows_one_function_and_asks_for_an_old_glibc(built_godot: None) -> None:
    library = build.BIN / build.file_name(build.HERE)
    shown = subprocess.check_output(["nm", "-D", "--defined-only", library], text=True)
    assert [line.split()[-1] for line in shown.splitlines()] == [build.ENTRY]
    asked = subprocess.check_output(["nm", "-D", "--undefined-only", library], text=True)
    versions = re.findall(r"@GLIBC_(\d+)\.(\d+)", asked)
    assert versions and max((int(major), int(minor)) for major, minor in versions) <= (2, 28)
    assert not re.search(r"GLIBCXX|_Z", asked), "the C++ library is inside"


@pytest.mark.godot
def test_the_table_is_what_the_engine_prints(tmp_path: Path) -> None:
    project = engine.project(tmp_path, add_on=False)
    engine.run(project, "--dump-gdextension-interface-json", "--dump-extension-api", headless=True)
    assert interface.engine_header(project) == interface.MADE.read_text("utf-8")
