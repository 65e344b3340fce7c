"""What the engine layer of the Unity package is compiled from without Unity: its own files, and stubs of Unity."""

from __future__ import annotations

from pathlib import Path

from tests.players.unity import STUBS, UNITY, core_sources

OF_PACKAGES = ("Universal", "HighDefinition", "ARFoundation")  # assemblies that need packages of Unity


def engine_sources() -> list[Path]:
    """Core, Runtime without the parts that need packages of Unity, Editor, and stubs."""
    runtime = [
        path for path in sorted((UNITY / "Runtime").rglob("*.cs")) if not {*OF_PACKAGES} & {*path.parts}
    ]
    stubs = [path for folder in ("engine", "editor") for path in sorted((STUBS / folder).glob("*.cs"))]
    # AssemblyInfo names friends for assemblies of Unity; here all is one.
    own = [path for path in [*core_sources(), *runtime] if path.name != "AssemblyInfo.cs"]
    return [*own, *sorted((UNITY / "Editor").rglob("*.cs")), *stubs]
