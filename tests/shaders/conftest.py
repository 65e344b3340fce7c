"""The Unity package as shaders find it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def unity_package(unity_package: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package in a project: includes that leave a folder begin there, and may pass through links."""
    name = json.loads((unity_package / "package.json").read_text("utf-8"))["name"]
    place = tmp_path_factory.mktemp("project") / "Packages" / name
    place.parent.mkdir()
    place.symlink_to(unity_package)
    return place
