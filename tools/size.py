"""How much the repository holds: `make size`, or `python -m tools.size [REVISION ...]`, HEAD by default.

Of each revision it prints tracked files and lines by kind. Each file has the first kind of these that fits:

- made: .gitattributes says linguist-generated (docs/decisions/made_files.md says why it stays in git);
- data: .gitattributes says `-text`, or the file is binary. Of what is binary no lines are counted;
- Markdown, tests, source: by suffix and folder.

Pages are files of Markdown, words those of their text without code. The .gitattributes of this checkout holds for older
revisions too, in addition to their own: what they did not mark yet is counted as it is today.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
KINDS = ("source", "tests", "made", "Markdown", "data")
_TESTS = re.compile(r"(^|/)[Tt]ests?/")
_CODE = re.compile(r"^```.*?^```|<!--.*?-->|\]\([^)]*\)", re.MULTILINE | re.DOTALL)
_WORD = re.compile(r"\S*\w\S*")


@dataclass(frozen=True)
class Tracked:
    """One tracked file."""

    path: str
    content: bytes
    made: bool
    data: bool

    @property
    def kind(self) -> str:
        """One of KINDS."""
        if self.made:
            return "made"
        if self.data or self.binary:
            return "data"
        if self.path.endswith(".md"):
            return "Markdown"
        return "tests" if _TESTS.search(self.path) else "source"

    @property
    def binary(self) -> bool:
        """As git guesses it."""
        return b"\0" in self.content[:8000]

    @property
    def lines(self) -> int:
        """Lines; 0 of a binary file."""
        ended = self.content.endswith(b"\n") or not self.content
        return 0 if self.binary else self.content.count(b"\n") + (not ended)

    @property
    def words(self) -> int:
        """Words outside of code blocks, comments and targets of links."""
        return len(_WORD.findall(_CODE.sub(" ", self.content.decode("utf-8"))))


def tracked(revision: str) -> list[Tracked]:
    """The files of a revision. Raises CalledProcessError for one that git does not know."""
    listed = _git("ls-tree", "-r", "-z", revision).decode()
    blobs = {
        path: said.split()[2] for said, _, path in (row.partition("\t") for row in listed.split("\0") if row)
    }
    contents = dict(zip(blobs, _contents([*blobs.values()]), strict=True))
    marks = _attributes(revision, [*blobs])
    return [
        Tracked(path, contents[path], (path, "linguist-generated") in marks, (path, "text") in marks)
        for path in blobs
    ]


def table(files: list[Tracked]) -> str:
    """What `make size` prints."""
    rows = [(kind, [file for file in files if file.kind == kind]) for kind in KINDS]
    rows += [("without data", [file for file in files if file.kind != "data"]), ("all", files)]
    lines = [f"{'':12} {'files':>7} {'lines':>9}"]
    lines += [f"{name:12} {len(found):7,} {sum(file.lines for file in found):9,}" for name, found in rows]
    pages = [file for file in files if file.path.endswith(".md")]
    return "\n".join([*lines, f"{len(pages):,} pages, {sum(page.words for page in pages):,} words"])


def _contents(blobs: list[str]) -> Iterator[bytes]:
    """The contents of blobs, in their order."""
    data, at = _git("cat-file", "--batch", given="\n".join(blobs).encode()), 0
    for _ in blobs:
        head, _, _ = data[at : at + 200].partition(b"\n")
        start, size = at + len(head) + 1, int(head.split()[2])
        yield data[start : start + size]
        at = start + size + 1


def _attributes(revision: str, paths: list[str]) -> set[tuple[str, str]]:
    """(path, attribute): linguist-generated where set, text where unset, by the revision's file or by today's."""
    found: set[tuple[str, str]] = set()
    for text in (_git("show", f"{revision}:.gitattributes"), (ROOT / ".gitattributes").read_bytes()):
        with TemporaryDirectory() as folder:  # git reads attributes of a work tree
            Path(folder, ".gitattributes").write_bytes(text)
            said = _git(
                *(f"--work-tree={folder}", "check-attr", "-z", "--stdin", "linguist-generated", "text"),
                given="\0".join(paths).encode(),
            )
        words = said.decode().split("\0")[:-1]
        rows = zip(words[::3], words[1::3], words[2::3], strict=True)
        found |= {(path, name) for path, name, value in rows if value == {"text": "unset"}.get(name, "set")}
    return found


def _git(*command: str, given: bytes | None = None) -> bytes:
    return subprocess.run(["git", *command], cwd=ROOT, input=given, capture_output=True, check=True).stdout


def main() -> None:
    """Prints the table of each revision."""
    for revision in sys.argv[1:] or ["HEAD"]:
        try:
            name = _git("rev-parse", "--short", f"{revision}^{{commit}}").decode().strip()
        except subprocess.CalledProcessError:
            sys.exit(f"size: {revision} is no revision of this repository")
        print(f"{name}\n{table(tracked(name))}")


if __name__ == "__main__":
    main()
