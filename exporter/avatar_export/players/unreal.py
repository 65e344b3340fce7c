"""The plugin for Unreal: hand-written files, the native player's sources, the HLSL as Unreal takes it, shader classes.

A plugin is copied into a project as a folder, and Unreal builds what lies in its modules: paths out of it would break
with the first copy. Shader texts of other languages are left out (GaussianAvatar.Build.cs says so to the sources).
"""

from __future__ import annotations

import json
import re

from avatar_export.players.native import native_sources, written
from avatar_export.players.sources import folder, license_text
from avatar_schema.version import __version__
from avatar_shaders.unreal import unreal_kernels, unreal_shaders

PLUGIN = "GaussianAvatar.uplugin"
MODULE = "Source/GaussianAvatar/Private"


def unreal_files() -> dict[str, bytes]:
    """{path below the plugin: content}."""
    root = folder("unreal")
    own = written(root, "Docs", "README.md", "Shaders", "Source")  # Unreal adds Binaries, Intermediate, Saved
    draws = own["Shaders/unreal_draw.usf"].decode("utf-8")
    made = {f"Shaders/{name}": text for name, text in unreal_shaders().items()}
    made |= {f"{MODULE}/Engine/{name}": text for name, text in unreal_kernels(draws).items()}
    made[PLUGIN] = described((root / PLUGIN).read_text("utf-8"), __version__)
    core = {f"{MODULE}/Native/{name}": data for name, data in native_sources("include", "src").items()}
    return own | core | {name: text.encode() for name, text in made.items()} | {"LICENSE": license_text()}


def described(text: str, version: str) -> str:
    """The plugin's description with its version: the number that Unreal compares, and the name that people read."""
    plugin = json.loads(text)
    major, minor, patch = map(int, re.findall(r"\d+", version)[:3])
    head = {"FileVersion": 3, "Version": 10000 * major + 100 * minor + patch, "VersionName": version}
    return json.dumps(head | plugin, indent="\t") + "\n"
