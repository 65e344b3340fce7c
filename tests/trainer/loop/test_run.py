"""run.json: what a command reads of it, and what it refuses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.loop import run
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.table import SYSTEMS
from tests.trainer import toy


@pytest.fixture(scope="module", autouse=True)
def toy_is_a_system() -> Iterator[None]:
    SYSTEMS["toy"] = toy.__name__
    yield
    del SYSTEMS["toy"]


@pytest.mark.parametrize(
    "change",
    [
        {"system": "other"},
        {"system": ["toy"]},
        {"settings": 3},
        {"settings": {"seed": "x"}},
        {"settings": {"seeed": 1}},
        {"system_settings": {"rules": {"sky": "green"}}},
        {"system_settings": {"density": 3}},
        {"capture": []},
    ],
)
def test_a_strange_run_json_is_bad_data(change: dict[str, object], tmp_path: Path) -> None:
    good = {"system": "toy", "settings": {}, "system_settings": {}, "capture": {}}
    run.write(tmp_path, good)
    assert run.settings_of(run.read(tmp_path), tmp_path) == (TrainSettings(), toy.Settings())
    run.write(tmp_path, {**good, **change})
    with pytest.raises(AvatarError, match=r"run\.json"):
        run.settings_of(run.read(tmp_path), tmp_path / run.FILE)


@pytest.mark.parametrize("text", ["", "[", "[]", "3", "[" * 100_000, "{" + " " * (1 << 20) + "}"])
def test_a_run_json_that_is_none(text: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(AvatarError, match=r"run\.json"):
        run.read(tmp_path)


def test_a_run_json_that_never_ends(tmp_path: Path) -> None:
    (tmp_path / "run.json").symlink_to("/dev/zero")
    with pytest.raises(AvatarError, match=r"run\.json: cannot be read \(is not a regular file\)"):
        run.read(tmp_path)
