"""Every public name that the table of all languages promises is there."""

from __future__ import annotations

import importlib
import inspect
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "docs" / "tools"))
vocabulary = importlib.import_module("vocabulary")

SOURCES = {  # language: (folder, files)
    "typescript": ("players/web/src", "*.ts"),
    "c": ("players/native/include", "*.h"),
    "csharp": ("players/unity", "*.cs"),
    "unreal": ("players/unreal/Source/GaussianAvatar/Public", "*.h"),
}
DECLARED = {  # language: (a type with its body, or a function; a member in that body)
    "typescript": (
        r"^export (?:async )?(?:class|interface|function) {}\b.*?^}}",
        r"^  (?:readonly |get |set |async )*{}\b[?(:; =]",
    ),
    "c": (
        r"^(?:typedef struct {0} {{.*?^}}|typedef struct {0} {0};|AVATAR_API [^;(]*\b{0}\()",
        r"^    [^/]*\b{}\b[;\[]",
    ),
    "csharp": (
        r"^    public (?:sealed |static |partial |abstract )*(?:class|struct) {}\b.*?^    }}",
        r"^        public [^=;{{]*\b{}\b",
    ),
    "unreal": (r"^class \w+_API {}\b.*?^}};", r"^\t[^/(]*\b{}\b(?:\(| = |;)"),
}
PROMISED = [
    (language, name)
    for row in vocabulary.concepts()
    for language in vocabulary.LANGUAGES
    for name in vocabulary.names(row, language)
]


def in_python(name: str) -> bool:
    """A name of a package, or an attribute, a field or an argument of it."""
    owner, _, member = name.partition(".")
    for package in ("avatar_runtime", "avatar_export"):
        found = getattr(importlib.import_module(package), owner, None)
        if found is not None:
            return not member or hasattr(found, member) or member in inspect.signature(found).parameters
    return False


def declared(language: str, name: str) -> bool:
    folder, files = SOURCES[language]
    whole, part = DECLARED[language]
    owner, _, member = name.partition(".")
    texts = [path.read_text("utf-8-sig") for path in sorted((ROOT / folder).rglob(files))]
    pattern = re.compile(whole.format(owner), re.MULTILINE | re.DOTALL)
    bodies = [match[0] for text in texts for match in pattern.finditer(text)]
    return bool(bodies) and (
        not member or any(re.search(part.format(member), body, re.MULTILINE) for body in bodies)
    )


@pytest.mark.parametrize(("language", "name"), PROMISED)
def test_a_promised_name_is_there(language: str, name: str) -> None:
    assert in_python(name) if language == "python" else declared(language, name)


@pytest.mark.parametrize("language", vocabulary.LANGUAGES)
def test_a_name_that_no_language_has_is_not_found(language: str) -> None:
    known = next(name for found, name in PROMISED if found == language).partition(".")[0]
    for name in ("Nothing", f"{known}.nothing"):
        assert not (in_python(name) if language == "python" else declared(language, name))
