"""`python -m avatar_shaders`: makes everything that is made from hlsl/ and from the tables of avatar_schema.

That is hlsl/constants.hlsli, hlsl/rules.hlsli, glsl/, msl/, wgsl/ and reflection.json, and in a checkout
the modules of the web player, and the tables of the players for Unity and of the native player.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from avatar_shaders.cpp import cpp_files
from avatar_shaders.csharp import csharp_files
from avatar_shaders.entries import FOLDERS
from avatar_shaders.generate import HLSL, PACKAGE, generate_all
from avatar_shaders.headers import made_headers
from avatar_shaders.tools import ShaderError
from avatar_shaders.web import web_files

ENGINES = PACKAGE.parent
ROOT = ENGINES.parent
WEB = "players/web/src/made"
CSHARP = "players/unity/Core/Made"
CPP = "players/native/src/made"
IN_CHECKOUT = (ROOT / "players").is_dir()  # an installed package has none
MADE = "by `python -m avatar_shaders`; do not edit"


def main() -> int:
    """0; 1 where --check finds a difference, 2 where a shader does not compile or a tool is missing."""
    parser = argparse.ArgumentParser(prog="python -m avatar_shaders", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; name the files that differ")
    parser.add_argument("--hlsl", type=Path, help="generate from the HLSL of this folder")
    parser.add_argument("--out", type=Path, help="write below this folder")
    asked = parser.parse_args()
    if bool(asked.hlsl) != bool(asked.out) or (asked.hlsl and asked.check):
        parser.error("--hlsl and --out go together, without --check")
    try:
        if asked.hlsl:
            write(asked.out, generate_all(asked.hlsl))
        elif asked.check:
            return _report(differing())
        else:
            write(HLSL, made_headers())  # all else includes them
            files = made_files()
            write(ROOT, files)
            for path in stale(files):
                path.unlink()
            print(f"{len(files)} files below {ROOT}")
    except ShaderError as error:
        print(f"avatar_shaders: {error}", file=sys.stderr)
        return 2
    return 0


def made_files() -> dict[str, str]:
    """{path below the checkout, or below what this package is in: text} of everything made. Raises ShaderError."""
    texts = {f"hlsl/{name}": text for name, text in made_headers().items()} | generate_all()
    files = {f"{PACKAGE.name}/{path}": text for path, text in texts.items()}
    files = {f"{ENGINES.name}/{path}": text for path, text in files.items()}
    if IN_CHECKOUT:
        files |= {f"{WEB}/{name}": text for name, text in web_files(texts).items()}
        files |= {f"{CSHARP}/{name}": text for name, text in csharp_files(texts).items()}
        files |= {f"{CPP}/{name}": text for name, text in cpp_files(texts).items()}
    return files


def differing() -> list[str]:
    """Paths of made files that are missing, different or no longer made. Raises ShaderError."""
    files = made_files()
    wrong = [path for path, text in files.items() if _text(ROOT / path) != text]
    return wrong + [str(path.relative_to(ROOT)) for path in stale(files)]


def stale(files: dict[str, str]) -> list[Path]:
    """Made files that are no longer made."""
    folders = [PACKAGE / folder for folder in sorted(set(FOLDERS.values()))]
    folders += [ROOT / WEB, ROOT / CSHARP, ROOT / CPP] if IN_CHECKOUT else []
    present = [path for folder in folders for path in sorted(folder.rglob("*")) if path.is_file()]
    made = [path for path in present if MADE.encode() in path.read_bytes()]
    return [path for path in made if str(path.relative_to(ROOT)) not in files]


def write(folder: Path, files: dict[str, str]) -> None:
    """Write {path: text} below a folder."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, "utf-8")


def _report(paths: list[str]) -> int:
    for path in paths:
        print(f"{path} differs: run python -m avatar_shaders")
    return 1 if paths else 0


def _text(path: Path) -> str | None:
    return path.read_text("utf-8") if path.is_file() else None


if __name__ == "__main__":
    sys.exit(main())
