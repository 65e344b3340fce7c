"""From what a run left back to its model: run.json, capture and checkpoint belong together, or one line says not."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.loop import checkpoint, run
from avatar_trainer.loop.resume import load_run
from avatar_trainer.loop.train import train
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.table import SYSTEMS
from tests.trainer import toy

OWN = toy.Settings(iterations=4)
SETTINGS = TrainSettings(iterations=4, threads=1, evaluate_every=0)


@pytest.fixture(scope="module", autouse=True)
def toy_is_a_system() -> Iterator[None]:
    SYSTEMS["toy"] = toy.__name__
    yield
    del SYSTEMS["toy"]


@pytest.fixture(scope="module")
def finished(toy_capture: Capture, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("run") / "out"
    go_on(toy_capture, out)
    return out


@pytest.fixture
def out(finished: Path, tmp_path: Path) -> Path:
    """A run's folder that a test may spoil."""
    return Path(shutil.copytree(finished, tmp_path / "out"))


def go_on(capture: Capture, out: Path) -> None:
    train(toy.create(capture, OWN, 0), capture, SETTINGS, out, system_settings=OWN)


def edit_run(out: Path, part: str, **changes: Any) -> None:
    content = json.loads((out / run.FILE).read_text())
    content[part].update(changes)
    (out / run.FILE).write_text(json.dumps(content))


def edit_checkpoint(out: Path, iteration: int = 4, **changes: Any) -> None:
    """Another checkpoint with a seal of its own; None: without."""
    found = checkpoint.newest(out / run.CHECKPOINTS, pytest.fail)
    assert found is not None
    checkpoint.remove(out / run.CHECKPOINTS)
    state = {**found.state, **{name: value for name, value in changes.items() if value is not ABSENT}}
    for name, value in changes.items():
        if value is ABSENT:
            del state[name]
    checkpoint.write(out / run.CHECKPOINTS, iteration, state)


ABSENT = object()


def test_a_run_is_loaded_as_it_was_left(toy_capture: Capture, out: Path) -> None:
    system, settings, iteration, _ = load_run(out)
    assert (settings, iteration) == (SETTINGS, 4)
    whole = checkpoint.newest(out / run.CHECKPOINTS, pytest.fail)
    assert whole is not None
    for name in system.table:
        assert torch.equal(system.table[name], whole.state["system"]["table"][name]["value"])
    edit_run(out, "settings", threads=2, preview_every=3)  # what does not change the model may differ
    assert load_run(out)[1].threads == 2


def test_a_run_with_another_capture_is_refused(toy_capture: Capture, out: Path, tmp_path: Path) -> None:
    trained_on = toy_capture.folder
    other = toy.capture_folder(tmp_path / "other", count=8)
    with pytest.raises(
        AvatarError, match=rf"other: is not the capture .*out was trained on, .*{trained_on}.*--capture"
    ):
        load_run(out, other)
    changed = Path(shutil.copytree(trained_on, tmp_path / "changed"))
    assert load_run(out, changed)[2] == 4
    described = json.loads((changed / "capture.json").read_text())
    described["frames"][5]["expression"] = [0.25]
    (changed / "capture.json").write_text(json.dumps(described))
    with pytest.raises(AvatarError, match="changed: is not the capture"):
        load_run(out, changed)


@pytest.mark.parametrize(
    ("part", "changes", "said"),
    [
        ("system_settings", {"rules": {"sky": "black"}}, r"rules\.sky was random, is black"),
        ("system_settings", {"learning_rate": 0.5}, "learning_rate was 0.02, is 0.5"),
        ("settings", {"rasteriser": "torch"}, "rasteriser was cpu, is torch"),
        ("settings", {"rasteriser": "gone"}, "'gone' is not a rasteriser"),
        ("settings", {"size": "x" * 300}, "expected a whole number"),
        ("capture", {"fingerprint": "0"}, "the capture's content is another"),
    ],
)
def test_a_run_json_that_was_edited_is_refused(
    out: Path, part: str, changes: dict[str, Any], said: str
) -> None:
    edit_run(out, part, **changes)
    with pytest.raises(AvatarError, match=said) as raised:
        load_run(out)
    assert str(raised.value).startswith(f"{out / run.FILE}: ")  # which of many


@pytest.mark.parametrize(
    "before", [None, [], [1], "run", 3, {}, {"settings": {"seed": torch.zeros(3)}}, ABSENT]
)
def test_a_checkpoint_that_does_not_say_of_which_run(toy_capture: Capture, out: Path, before: Any) -> None:
    edit_checkpoint(out, run=before)
    with pytest.raises(AvatarError, match="differs from its checkpoint"):
        load_run(out)
    with pytest.raises(AvatarError, match=r"holds another run .*--no-resume"):
        go_on(toy_capture, out)


def test_a_checkpoint_from_after_the_end_is_refused(toy_capture: Capture, out: Path) -> None:
    edit_checkpoint(out, 5)
    for again in (lambda: load_run(out), lambda: go_on(toy_capture, out)):
        with pytest.raises(AvatarError, match="the checkpoint is of iteration 5, the last is 4"):
            again()


@pytest.mark.parametrize("name", ["generator", "torch"])
@pytest.mark.parametrize(
    "value",
    [ABSENT, "text", torch.zeros(3, dtype=torch.uint8), torch.zeros(5056), torch.zeros(5056).byte()],
    ids=["absent", "text", "short", "floats", "zeros"],
)
def test_random_numbers_that_cannot_go_on(toy_capture: Capture, out: Path, name: str, value: Any) -> None:
    edit_checkpoint(out, **{name: value})
    with pytest.raises(AvatarError, match=r"random numbers cannot be restored .*--no-resume"):
        go_on(toy_capture, out)


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
