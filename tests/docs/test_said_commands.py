"""Commands that pages name agree with one another."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("trainer/*.md")]


def test_no_page_writes_where_make_docs_builds_the_site() -> None:
    """MkDocs empties that folder: it once held a published avatar."""
    [site] = re.findall(r"^site_dir: (\S+)", (ROOT / "mkdocs.yml").read_text("utf-8"), re.MULTILINE)
    text = "\n".join(page.read_text("utf-8") for page in PAGES)
    text += "\n".join(
        e["run"] for e in tomllib.loads((ROOT / "docs/tools/examples.toml").read_text("utf-8"))["example"]
    )
    written = {PurePosixPath(path) for path in re.findall(r"(?:-o|--out|--export|-B) ([\w./-]+)", text)}
    assert PurePosixPath("out/site") in written
    built = PurePosixPath(site)
    assert not [path for path in written if path == built or built in path.parents]
