"""`python -m avatar_shaders`: writes constants.hlsli, glsl430/, glsl310es/, msl/ and reflection.json again."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from avatar_shaders import LANGUAGES
from avatar_shaders.constants import constants_hlsli
from avatar_shaders.generate import PACKAGE, generate_all
from avatar_shaders.tools import ShaderError

CONSTANTS = "hlsl/constants.hlsli"


def main() -> int:
    """0; 1 where --check finds a difference, 2 where a shader does not compile or a tool is missing."""
    parser = argparse.ArgumentParser(prog="python -m avatar_shaders", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; name the files that differ")
    parser.add_argument("--hlsl", type=Path, help="generate from the HLSL of this folder")
    parser.add_argument("--out", type=Path, help="write below this folder")
    asked = parser.parse_args()
    if asked.hlsl and not asked.out:
        parser.error("--hlsl needs --out: text from other HLSL does not belong into the package")
    try:
        return _check() if asked.check else _write(asked.hlsl, asked.out or PACKAGE)
    except ShaderError as error:
        print(f"avatar_shaders: {error}", file=sys.stderr)
        return 2


def _write(hlsl: Path | None, out: Path) -> int:
    if hlsl is None:
        hlsl = PACKAGE / "hlsl"
        (PACKAGE / CONSTANTS).write_text(constants_hlsli(), "utf-8")  # what follows includes it
    texts = generate_all(hlsl)
    for path in stale(out, texts):
        path.unlink()
    for name, text in texts.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, "utf-8")
    return 0


def _check() -> int:
    texts = {CONSTANTS: constants_hlsli(), **generate_all()}
    differing = [name for name, text in texts.items() if _text(PACKAGE / name) != text]
    differing += [str(path.relative_to(PACKAGE)) for path in stale(PACKAGE, texts)]
    for name in differing:
        print(f"{name} differs: run python -m avatar_shaders")
    return 1 if differing else 0


def stale(out: Path, texts: dict[str, str]) -> list[Path]:
    """Generated files below `out` that nothing generates any more."""
    present = sorted(path for language in LANGUAGES for path in (out / language).glob("*"))
    return [path for path in present if str(path.relative_to(out)) not in texts]


def _text(path: Path) -> str | None:
    return path.read_text("utf-8") if path.is_file() else None


if __name__ == "__main__":
    sys.exit(main())
