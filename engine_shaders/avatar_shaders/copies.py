"""The HLSL under names that an engine accepts: flat copies whose #includes say the new names."""

from __future__ import annotations

import re
from pathlib import Path

_INCLUDE = re.compile(r'#include "(\w+)\.(hlsli?)"')


def copies(hlsl: Path, core: str, plain: str, head: str) -> dict[str, str]:
    """{name: text} of all files of `hlsl`: `x.hlsli` becomes x + `core`, `x.hlsl` becomes x + `plain`.

    Each begins with `head`, which names its source as {name}.
    """
    suffix = {"hlsli": core, "hlsl": plain}

    def renamed(match: re.Match[str]) -> str:
        return f'#include "{match[1]}{suffix[match[2]]}"'

    return {
        path.stem + suffix[path.suffix[1:]]: head.format(name=path.name)
        + _INCLUDE.sub(renamed, path.read_text("utf-8"))
        for path in sorted(hlsl.glob("*.hlsl*"))
    }
