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
from avatar_trainer import cli
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.loop import checkpoint, run
from avatar_trainer.loop.iterate import Trainer
from avatar_trainer.loop.machine import reproducible
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
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return load(toy.capture_folder(tmp_path_factory.mktemp("capture") / "toy"))


@pytest.fixture(scope="module")
def finished(capture: Capture, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("run") / "out"
    go_on(capture, out)
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


def test_a_run_is_loaded_as_it_was_left(capture: Capture, out: Path) -> None:
    system, settings, iteration = load_run(out)
    assert (settings, iteration) == (SETTINGS, 4)
    whole = checkpoint.newest(out / run.CHECKPOINTS, pytest.fail)
    assert whole is not None
    for name in system.table:
        assert torch.equal(system.table[name], whole.state["system"]["table"][name]["value"])
    edit_run(out, "settings", threads=2, preview_every=3)  # what does not change the model may differ
    assert load_run(out)[1].threads == 2


def test_a_run_with_another_capture_is_refused(capture: Capture, out: Path, tmp_path: Path) -> None:
    trained_on = capture.folder
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
        ("settings", {"seed": 3}, "seed was 0, is 3"),
        ("settings", {"iterations": 5}, "iterations was 4, is 5"),
        ("settings", {"rasteriser": "torch"}, "rasteriser was cpu, is torch"),
        ("settings", {"rasteriser": "gone"}, "'gone' is not a rasteriser"),
        ("settings", {"rasteriser": "cpuu"}, "did you mean cpu"),
        ("settings", {"size": "x" * 300}, "expected a whole number"),
        ("capture", {"fingerprint": "0"}, "the capture's content is another"),
        ("capture", {"fingerprint": None}, "the capture's content is another"),
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
def test_a_checkpoint_that_does_not_say_of_which_run(capture: Capture, out: Path, before: Any) -> None:
    edit_checkpoint(out, run=before)
    with pytest.raises(AvatarError, match="of the checkpoint beside it"):
        load_run(out)
    with pytest.raises(AvatarError, match=r"holds another run .*--no-resume"):
        go_on(capture, out)


@pytest.mark.parametrize("command", ["evaluate", "export", "compare"])
def test_every_command_says_so_in_one_line(
    capture: Capture,
    out: Path,
    tmp_path: Path,
    command: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    other = toy.capture_folder(tmp_path / "other", count=8)
    bundle = [] if command == "evaluate" else [str(tmp_path / "bundle")]
    monkeypatch.setattr("sys.argv", ["avatar-train", command, str(out), *bundle, "--capture", str(other)])
    with pytest.raises(SystemExit) as end:
        cli.main()
    said = capfd.readouterr().err
    assert end.value.code == 2 and said.count("\n") == 1 and "is not the capture that" in said


@pytest.mark.parametrize("iteration", [5, 10**9 - 1])
def test_a_checkpoint_from_after_the_end_is_refused(capture: Capture, out: Path, iteration: int) -> None:
    edit_checkpoint(out, iteration)
    said = f"the checkpoint is of iteration {iteration}, the last is 4"
    with pytest.raises(AvatarError, match=said):
        load_run(out)
    with pytest.raises(AvatarError, match=said):
        go_on(capture, out)


def test_a_checkpoint_from_before_the_start_is_none(out: Path) -> None:
    edit_checkpoint(out)
    path = checkpoint.path_of(out / run.CHECKPOINTS, 4)
    content = checkpoint.read(path)
    path.unlink()
    written = checkpoint.write(path.parent, -1, content.state)
    written.rename(path)
    with pytest.raises(AvatarError, match="not a checkpoint of avatar-train"):
        checkpoint.read(path)


@pytest.mark.parametrize("name", ["generator", "torch"])
@pytest.mark.parametrize(
    "value",
    [
        ABSENT,
        None,
        "text",
        [1, 2],
        torch.zeros(3, dtype=torch.uint8),
        torch.zeros(5056),
        torch.zeros(5056).byte(),
    ],
    ids=["absent", "none", "text", "list", "short", "floats", "zeros"],
)
def test_random_numbers_that_cannot_go_on(capture: Capture, out: Path, name: str, value: Any) -> None:
    edit_checkpoint(out, **{name: value})
    with pytest.raises(AvatarError, match=r"random numbers cannot be restored .*--no-resume"):
        go_on(capture, out)


def test_both_generators_go_on(capture: Capture) -> None:
    """A system draws from the run's own generator; libraries may draw from torch's."""
    with reproducible(3, 1):
        first, second = (Trainer(toy.create(capture, OWN, 0), capture, SETTINGS) for _ in range(2))
        torch.rand(5)
        torch.rand(5, generator=first.generator)
        state = first.state()
        expected = torch.rand(4), torch.rand(4, generator=first.generator)
        torch.rand(7)
        second.load_state(state)
        found = torch.rand(4), torch.rand(4, generator=second.generator)
    assert torch.equal(found[0], expected[0]) and torch.equal(found[1], expected[1])
