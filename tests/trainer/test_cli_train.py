"""avatar-train as somebody types it: one line and exit code 2 for whatever is wrong, before training starts."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from avatar_runtime.errors import AvatarError
from avatar_trainer import cli, finished, run
from avatar_trainer.cli_train import train_command
from avatar_trainer.densify import DensitySettings
from avatar_trainer.settings import TrainSettings, chosen_rules, settable, with_values
from avatar_trainer.systems import SYSTEMS, system_module
from tests.trainer import toy

Train = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module", autouse=True)
def toy_is_a_system() -> Iterator[None]:
    """The toy is in the table and on the command line, for these tests only."""
    SYSTEMS["toy"] = toy.__name__
    commands = list(cli.app.registered_commands)
    cli.app.command("toy")(train_command("toy"))
    yield
    cli.app.registered_commands = commands
    del SYSTEMS["toy"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return toy.capture_folder(tmp_path_factory.mktemp("capture") / "toy")


@pytest.fixture
def avatar_train(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Train:
    """Runs the command; (exit code, standard output, standard error)."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["avatar-train", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            cli.main()
        out, err = capfd.readouterr()
        code = end.value.code
        return (code if isinstance(code, int) else 0), out, err

    return command


SHORT = ("--iterations", 6, "--threads", 1)


def test_from_a_capture_to_a_measured_avatar(folder: Path, tmp_path: Path, avatar_train: Train) -> None:
    out = tmp_path / "out"
    code, said, err = avatar_train(
        "toy", folder, "-o", out, *SHORT, "--gaussians", 30, "--set", "density.densify_every=3",
        "--rule", "sky=random", "--set", "log_every=2", "--seed", 7, "--size", 32,
    )  # fmt: skip
    assert code == 0, err
    assert "6 iterations" in said and "PSNR dB" in said
    facts = json.loads((out / "run.json").read_text())
    assert facts["system_settings"]["rules"] == {"sky": "random"}
    assert facts["system_settings"]["density"]["densify_every"] == 3
    assert facts["system_settings"]["gaussians"] == 30 and facts["system_settings"]["iterations"] == 6
    assert {k: facts["settings"][k] for k in ("iterations", "seed", "size", "log_every")} == {
        "iterations": 6, "seed": 7, "size": 32, "log_every": 2,
    }  # fmt: skip
    written = json.loads((out / "evaluation.json").read_text())
    assert written["iteration"] == 6 and written["width"] == 32

    (out / "evaluation.json").unlink()
    code, said, err = avatar_train("evaluate", out, "--json")
    assert code == 0, err
    assert json.loads(said)["splits"] == written["splits"]
    assert json.loads((out / "evaluation.json").read_text()) == written

    code, _, err = avatar_train("toy", folder, "-o", out, *SHORT)
    assert code == 2 and err.count("\n") == 1
    assert "gaussians was 30, is 40" in err and "--no-resume" in err
    assert avatar_train("toy", folder, "-o", out, *SHORT, "--no-resume")[0] == 0
    assert json.loads((out / "run.json").read_text())["settings"]["size"] == 0


def test_a_run_finds_its_capture_or_says_so(folder: Path, tmp_path: Path, avatar_train: Train) -> None:
    out, moved = tmp_path / "out", tmp_path / "moved"
    moved.symlink_to(folder)
    assert avatar_train("toy", folder, "-o", out, *SHORT)[0] == 0
    facts = json.loads((out / "run.json").read_text())
    facts["capture"]["folder"] = str(tmp_path / "gone")
    (out / "run.json").write_text(json.dumps(facts))
    code, _, err = avatar_train("evaluate", out)
    assert code == 2 and "say where with --capture" in err
    system, settings, iteration = finished.load_run(out, moved)
    assert iteration == 6 and settings.iterations == 6 and system.table.count("cloud") == 40


def test_export_and_compare_get_the_trained_model(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[str, tuple[object, ...], dict[str, object]]] = []

    def export(system: toy.Toy, *args: object, **options: object) -> None:
        calls.append((system.name, args, options))

    monkeypatch.setattr("avatar_trainer.export.export", export)
    out, bundle = tmp_path / "out", tmp_path / "bundle"
    code, said, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", bundle)
    assert code == 0 and str(bundle) in said, err
    assert (out / "upstream" / "toy6.npz").is_file()
    assert avatar_train("export", out, bundle, "--no-preview", "--force")[0] == 0
    assert calls == [
        ("toy", (out / "upstream", bundle), {}),
        ("toy", (out / "upstream", bundle), {"engine_files": True, "preview": False, "force": True}),
    ]
    bundle.mkdir()
    code, _, err = avatar_train("toy", folder, "-o", tmp_path / "other", *SHORT, "--export", bundle)
    assert code == 2 and "exists" in err and not (tmp_path / "other").exists()
    code, _, err = avatar_train("compare", out, tmp_path / "none")
    assert code == 2 and err.count("\n") == 1


WRONG = [
    (["--set", "densityy=3"], "'densityy' is no setting; did you mean"),
    (["--set", "density=3"], "'density' is no setting"),
    (["--set", "density.densify_ever=3"], "did you mean density.densify_every"),
    (["--set", "density.densify_every=few"], "expected a whole number"),
    (["--set", "learning_rate=nan"], "expected a finite number"),
    (["--set", "learning_rate=-1"], "learning_rate must be above 0"),
    (["--set", "log_every=0"], "log_every is 0; at least 1"),
    (["--set", "rules=3"], "'rules' is no setting"),
    (["--set", "iterations=3"], "'iterations' is no setting"),
    (["--set", "seed"], "'seed' is not NAME=VALUE"),
    (["--rule", "skye=black"], "did you mean sky?"),
    (["--rule", "sky=blak"], "did you mean black?"),
    (["--rasteriser", "gpu"], "'gpu' is none of cpu"),
    (["--sh-degree", "4"], "--sh-degree"),
    (["--iterations", "0"], "--iterations"),
]


@pytest.mark.parametrize(("options", "said"), WRONG, ids=[" ".join(options) for options, _ in WRONG])
def test_a_wrong_option_ends_before_anything_is_written(
    options: list[str], said: str, folder: Path, tmp_path: Path, avatar_train: Train
) -> None:
    code, _, err = avatar_train("toy", folder, "-o", tmp_path / "out", *options)
    flat = " ".join(err.replace("│", " ").split())
    assert code == 2 and said in flat and "Traceback" not in err
    assert not (tmp_path / "out").exists()


def test_bad_captures_and_runs_are_one_line(folder: Path, tmp_path: Path, avatar_train: Train) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    for arguments in (
        ("check", empty),
        ("toy", empty, "-o", tmp_path / "out"),
        ("evaluate", empty),
        ("evaluate", tmp_path / "none"),
        ("export", empty, tmp_path / "bundle"),
        ("toy", folder, "-o", folder / "capture.json"),
    ):
        code, _, err = avatar_train(*arguments)
        assert code == 2 and err.startswith("avatar-train: ") and err.count("\n") == 1, err


def test_a_damaged_picture_is_found_before_training(
    folder: Path, tmp_path: Path, avatar_train: Train
) -> None:
    import shutil

    copy = tmp_path / "capture"
    shutil.copytree(folder, copy)
    image = copy / "images" / "007.png"
    data = bytearray(image.read_bytes())
    data[len(data) // 2] ^= 0xFF
    image.write_bytes(data)
    for arguments in (("check", copy), ("toy", copy, "-o", tmp_path / "out", *SHORT)):
        code, _, err = avatar_train(*arguments)
        assert code == 2 and "007.png" in err and err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_memory_that_ran_out_is_one_line(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(toy, "create", lambda *_: (_ for _ in ()).throw(MemoryError()))
    code, _, err = avatar_train("toy", folder, "-o", tmp_path / "out", *SHORT)
    assert code == 2 and "lower --gaussians" in err and err.count("\n") == 1


def test_check_says_what_is_there(folder: Path, avatar_train: Train) -> None:
    code, said, _ = avatar_train("check", folder)
    assert code == 0 and "9 to train on, 3 held out" in said


def test_rules_and_settings_are_listed(avatar_train: Train) -> None:
    code, said, _ = avatar_train("rules", "--json")
    listed = json.loads(said)
    assert code == 0 and set(listed) == set(SYSTEMS)
    assert listed["toy"]["sky"] == {
        "values": ["random", "black"], "released": "random", "paper": "black", "default": "random",
        "about": "what is behind the cloud",
    }  # fmt: skip
    assert "sky = random | black" in avatar_train("rules")[1]
    code, said, _ = avatar_train("settings", "toy", "--json")
    assert code == 0 and json.loads(said)["density.max_gaussians"] == 80
    assert "density.max_gaussians" in avatar_train("settings", "toy")[1]
    assert avatar_train("settings", "toi")[0] == 2


@pytest.mark.parametrize("name", SYSTEMS)
def test_every_system_has_what_the_command_line_asks_for(name: str) -> None:
    module = system_module(name)
    settings = module.Settings()
    assert settings.iterations > 0 and settings.gaussians > 0 and 0 <= settings.sh_degree <= 3
    assert settings.rules == chosen_rules(module.RULES, [])
    for rule in module.RULES.values():
        assert rule.default in rule.values and rule.about and "\n" not in rule.about
    for key, value in settable(settings, ("rules",)).items():
        text = ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
        assert with_values(settings, [(key, text)]) == settings


@pytest.mark.parametrize(
    "change",
    [
        {"system": "other"},
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
    assert run.settings_of(run.read(tmp_path)) == (TrainSettings(), toy.Settings())
    run.write(tmp_path, {**good, **change})
    with pytest.raises(AvatarError, match=r"run\.json"):
        run.settings_of(run.read(tmp_path))


@pytest.mark.parametrize("text", ["", "[", "[]", "3", "[" * 100_000, "{" + " " * (1 << 20) + "}"])
def test_a_run_json_that_is_none(text: str, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(AvatarError, match=r"run\.json"):
        run.read(tmp_path)


def test_settings_are_read_by_the_types_of_their_fields() -> None:
    settings = with_values(DensitySettings(), [("gradient_threshold", "1e-3")])
    assert settings.gradient_threshold == 1e-3
    assert with_values(TrainSettings(), [("cache_megabytes", "7")]).cache_megabytes == 7
    for text in ("7.5", "1e3", "9" * 30, "", "inf"):
        with pytest.raises(AvatarError, match="whole number"):
            with_values(TrainSettings(), [("cache_megabytes", text)])
    with pytest.raises(ValueError, match="seed is -1"):
        TrainSettings(seed=-1)


@dataclass(frozen=True)
class Pair:
    low: int = 1
    high: int = 2
    at: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.low > self.high:
            raise ValueError("low is above high")


def test_settings_that_hang_together_are_set_together() -> None:
    pair = with_values(Pair(), [("low", "5"), ("high", "6"), ("at", "1,2.5")])
    assert pair == Pair(5, 6, (1.0, 2.5))
    assert with_values(pair, [("at", "")]).at == ()
    with pytest.raises(AvatarError, match="low is above high"):
        with_values(Pair(), [("low", "5")])


PROGRAM = """
import importlib.util, sys
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name in {hidden!r} else find(name, *rest)
from avatar_trainer.__main__ import main
sys.argv = ["avatar-train", "--help"]
main()
"""


def test_without_torch_it_says_what_to_install() -> None:
    program = PROGRAM.format(hidden=("torch", "tensorboard"))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == 'avatar-train: needs torch, tensorboard: pip install "avatar-export[train]"\n'
