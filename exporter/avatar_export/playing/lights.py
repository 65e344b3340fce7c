"""The light of a scene, by the name of a preset or from a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from avatar_export.playing.environment import SUFFIX, environment_light
from avatar_export.relight import light_json
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import Light, light_of


@cache
def presets() -> Mapping[str, Any]:
    """Lights by name, as JSON says them; the viewer has the same."""
    found: Mapping[str, Any] = json.loads((files("avatar_export") / "light_presets.json").read_text())
    return found


def scene_light(text: str) -> Light:
    """The light of a preset's name, or of a file. Raises AvatarError for what is neither."""
    if text in presets():
        return light_of(presets()[text])
    path = Path(text)
    if not path.is_file():
        known = ", ".join(presets())
        raise AvatarError(f"is neither a light ({known}) nor a file", field="--light", file=text[:80])
    if path.suffix.lower() == SUFFIX:
        return environment_light(path)
    return light_of(light_json(path), path.name)
