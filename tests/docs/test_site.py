"""The site builds strictly, and its pages load nothing from elsewhere; `make test-more` runs this."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# What a page loads by itself; links that a reader follows may lead anywhere.
LOADED = re.compile(
    r"<(?:script|img|source|iframe|video|audio)\b[^>]*\bsrc=\"([^\"]+)\"|<link\b[^>]*>|url\(([^)]+)\)|@import[^;]+"
)
HREF = re.compile(r"href=\"([^\"]+)\"")
ELSEWHERE = re.compile(r"^[\"']?(?:https?:)?//")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    beside = Path(sys.executable).with_name("mkdocs")
    mkdocs = str(beside) if beside.exists() else shutil.which("mkdocs")
    assert mkdocs, "the site needs mkdocs: make docs installs it"
    out = tmp_path_factory.mktemp("site")
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    command = [mkdocs, "build", "--strict", "--site-dir", str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0 and "WARNING" not in done.stderr, done.stderr[-3000:]
    return out


@pytest.mark.more
def test_pages_load_nothing_from_elsewhere(site: Path) -> None:
    pages = [*site.rglob("*.html"), *site.rglob("*.css")]
    assert len(pages) > 60
    for page in pages:
        text = page.read_text("utf-8")
        assert 'class="mermaid' not in text, "the theme would load its drawing library from elsewhere"
        for match in LOADED.finditer(text):
            found = match[1] or match[2] or match[0]
            targets = HREF.findall(found) if found.startswith("<link") else [found]
            assert not [target for target in targets if ELSEWHERE.match(target)], f"{page.name}: {found}"


@pytest.mark.more
def test_files_outside_docs_are_in_the_site(site: Path) -> None:
    for page in (
        "schema/SPEC.html",
        "engine_shaders/index.html",
        "trainer/index.html",
        "samples/driven.webp",
        "players/web/examples/plain/avatar-export-player/element.js",
        "players/web/examples/plain/avatar-export-player/sample.avatar",
    ):
        assert (site / "repository" / page).exists(), page
