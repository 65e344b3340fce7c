"""Makes beforehand what the tests need to run programs for Windows: `python -m tools.windows.prepare`.

That is Wine's prefix, Microsoft's compiler of shaders, and the program that calls it. Run again it says what is there,
without a net.
"""

from __future__ import annotations

import sys

from tests.shaders import fxc

from avatar_shaders.tools import ShaderError
from tools.windows import wine
from tools.windows.compiler import compiler
from tools.zig import BuildError


def main() -> int:
    try:
        print(f"Wine: {wine.program()}, {wine.prefix()}; {compiler()}; {fxc.program()}")
    except (wine.Missing, BuildError, ShaderError, OSError) as error:
        print(f"No program for Windows can be run: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
