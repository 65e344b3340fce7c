"""avatar-train as somebody types it: one line and exit code 2 for whatever is wrong, before training starts."""

from __future__ import annotations

import errno
import importlib.util
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from avatar_export.writers.bundle import write_bundle
from avatar_runtime.io.errors import AvatarError
from avatar_trainer import cli, finished, run
from avatar_trainer.cli_train import train_command
from avatar_trainer.settings import TrainSettings, chosen_rules, settable, with_values
from avatar_trainer.systems import SYSTEMS, system_module
from tests.avatars import full_avatar
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
        ("toy", (out / "upstream", bundle), {"force": False}),
        ("toy", (out / "upstream", bundle), {"engine_files": True, "preview": False, "force": True}),
    ]
    bundle.mkdir()
    code, _, err = avatar_train("toy", folder, "-o", tmp_path / "other", *SHORT, "--export", bundle)
    assert code == 2 and "exists" in err and not (tmp_path / "other").exists()
    code, _, err = avatar_train("compare", out, tmp_path / "none")
    assert code == 2 and err.count("\n") == 1


def test_the_same_command_exports_once(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    def export(system: toy.Toy, upstream: Path, bundle: Path, *, force: bool) -> None:
        forced.append(force)
        write_bundle(full_avatar(), bundle, preview=False, engine_files=False, reference=False, force=force)

    forced: list[bool] = []
    monkeypatch.setattr("avatar_trainer.export.export", export)
    bundle = tmp_path / "bundle"
    again = ("toy", folder, "-o", tmp_path / "out", *SHORT, "--export", bundle)
    assert avatar_train(*again)[0] == 0 and forced == [False]
    code, said, err = avatar_train(*again)
    assert code == 0 and "is there already" in said and forced == [False], err
    assert avatar_train(*again, "--force")[0] == 0 and forced == [False, True]
    shutil.rmtree(bundle)
    assert avatar_train(*again)[0] == 0 and forced == [False, True, False]
    code, _, err = avatar_train(*again, "--no-resume")
    assert code == 2 and "exists; pass --force" in err and (tmp_path / "out" / "evaluation.json").is_file()


def test_places_that_cannot_be_written_are_found_first(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(toy, "create", lambda *_: pytest.fail("prepared"))
    out, file, closed, photos = (tmp_path / name for name in ("out", "file", "closed", "photos"))
    file.write_text("")
    photos.mkdir()
    (photos / "holiday.jpg").write_text("dear")
    closed.mkdir()
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: path != closed and allowed(path, mode))
    for place, said in [
        (out, "in each other"),
        (out / "bundle", "in each other"),
        (tmp_path, "in each other"),
        (file / "bundle", "is a file"),
        (closed / "deeper" / "bundle", "does not permit"),
        (file, "exists; pass --force"),
        (photos, "exists; pass --force"),
    ]:
        code, _, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", place)
        assert code == 2 and said in err and err.count("\n") == 1, err
    code, _, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", photos, "--force")
    assert code == 2 and "is not a bundle" in err
    assert not out.exists()
    for name in ("checkpoints", "logs", "upstream", "preview"):
        run_folder = tmp_path / f"with_{name}"
        run_folder.mkdir()
        (run_folder / name).write_text("")
        code, _, err = avatar_train("toy", folder, "-o", run_folder, *SHORT)
        assert code == 2 and f"with_{name}/{name}: is a file" in err and err.count("\n") == 1
    for place, said in [(file, "is a file"), (file / "run", "is a file"), (closed / "a" / "b", "not permit")]:
        code, _, err = avatar_train("toy", folder, "-o", place, *SHORT)
        assert code == 2 and said in err and err.count("\n") == 1


def test_a_full_disk_is_one_line_that_names_the_run(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for place in ("checkpoint.write", "run.write", "train.Logs", "cli_train.save_upstream"):
        out = tmp_path / place
        with monkeypatch.context() as patched:
            patched.setattr(f"avatar_trainer.{place}", full)
            code, _, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", tmp_path / "bundle")
        assert code == 2 and "Traceback" not in err
        assert err.splitlines()[-1] == f"avatar-train: {out}: cannot be written (No space left on device)"


def test_beginning_anew_checks_the_pictures_first_and_leaves_nothing_old(
    folder: Path, tmp_path: Path, avatar_train: Train
) -> None:
    copy, out = tmp_path / "capture", tmp_path / "out"
    shutil.copytree(folder, copy)
    assert avatar_train("toy", copy, "-o", out, *SHORT, "--preview")[0] == 0
    (out / "mine.txt").write_text("dear")
    (out / "preview" / "mine.png").write_text("dear")
    before = sorted(out.rglob("*"))
    image = copy / "images" / "007.png"
    whole = image.read_bytes()
    damaged = bytearray(whole)
    damaged[len(whole) // 2] ^= 0xFF
    image.write_bytes(damaged)
    code, _, err = avatar_train("toy", copy, "-o", out, "--iterations", 4, "--no-resume")
    assert code == 2 and "007.png" in err and sorted(out.rglob("*")) == before
    image.write_bytes(whole)
    # It ends before its first checkpoint: what is there is its own, and what the command did not write.
    failed = ("--iterations", 4, "--no-resume", "--set", "poison=1")
    code, _, err = avatar_train("toy", copy, "-o", out, *failed)
    assert code == 2 and "no checkpoint yet" in err
    left = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert {name for name in left if "tfevents" not in name} == {"mine.txt", "preview/mine.png", "run.json"}
    assert sum("tfevents" in name for name in left) == 1


def test_what_is_missing_is_told_before_preparing(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name in ("gsplat", "lpips") else find(name)
    )
    for arguments, said in [
        (("toy", "--rasteriser", "gsplat"), "rasteriser gsplat: needs gsplat"),
        (("splatting_avatar", "--set", "lpips=1"), "lpips: needs the package lpips"),
        (("gaussian_blendshapes", "--set", "weights.lpips=1"), "weights.lpips: needs the package lpips"),
        (
            ("splatting_avatar", "--rule", "embedding=fixed", "--export", tmp_path / "bundle"),
            "embedding=fixed is for comparison",
        ),
        (
            ("psavatar", "--rule", "order=as_printed", "--export", tmp_path / "bundle"),
            "order=as_printed is for comparison",
        ),
    ]:
        system, *options = arguments
        code, _, err = avatar_train(system, tmp_path / "no capture", "-o", tmp_path / "out", *options)
        assert code == 2 and said in err and err.count("\n") == 1, err


OUT_OF_RANGE = {
    "toy": (
        ("--seed", "4294967296", "seed is 4294967296; at least 0, at most 2147483647"),
        ("--size", "99999999999", "size is 99999999999"),
        ("--threads", "99999999999", "threads is 99999999999"),
        ("--iterations", "99999999999", "iterations is 99999999999"),
        ("--set", "density.densify_every=0", "densify_every is 0; at least 1"),
        ("--set", "density.opacity_reset_every=0", "opacity_reset_every is 0"),
        ("--set", "density.percent_dense=-1", "percent_dense is -1.0; at least 0"),
        ("--set", "density.min_opacity=2", "min_opacity is 2.0; at least 0, at most 1"),
        ("--set", "density.max_world_scale=0", "max_world_scale is 0.0"),
    ),
    "splatting_avatar": (
        ("--gaussians", "1000001", "gaussians is 1000001; at least 1, at most 1000000"),
        ("--set", "sh_degree_every=0", "sh_degree_every is 0; at least 1"),
        ("--set", "learning_rates.position=-1", "settings.learning_rates: position is -1.0"),
        ("--set", "learning_rates.position=0", "position is 0.0"),
        ("--set", "learning_rates.sh=-1", "sh is -1.0; at least 0"),
        ("--set", "scaling=-1", "scaling is -1.0"),
        ("--set", "thin_ratio=0", "thin_ratio is 0.0"),
        ("--set", "walk_decay=2", "walk_decay is 2.0"),
    ),
    "psavatar": (
        ("--gaussians", "1000001", "gaussians is 1000001; at least 1, at most 1000000"),
        ("--set", "off_mesh=1.1", "off_mesh is 1.1; at least 0, at most 1"),
        ("--set", "r_max=-0.1", "r_max is -0.1"),
        ("--set", "acquiring=1", "acquiring is 1.0; at least 0, at most 0.9"),
        ("--set", "region=nose", "region is 'nose'; one of all, head, face"),
        ("--set", "vgg=0.1", "vgg needs vgg_weights"),
        ("--set", "learning_rates.falls_to=0", "falls_to is 0.0"),
    ),
    "gaussian_blendshapes": (
        ("--gaussians", "250001", "gaussians is 250001; at least 4, at most 250000"),
        ("--set", "mouth_gaussians=250001", "mouth_gaussians is 250001"),
        ("--set", "rates.mean=0", "mean is 0.0"),
        ("--set", "rates.delta_sh=-1", "delta_sh is -1.0"),
        ("--set", "weights.alpha=-1", "alpha is -1.0"),
        ("--set", "weights.dssim=2", "dssim is 2.0; at least 0, at most 1"),
        ("--set", "mouth_cylinder=0,0,0,1e-9,0", "mouth_cylinder has radius 1e-09"),
        ("--set", "mouth_cylinder=0,0,0,0.05,0", "half height 0.0; at least 0.001"),
        ("--set", "extent=0", "extent is 0.0"),
        ("--set", "least_mask=2", "least_mask is 2.0"),
        ("--set", "expressions=10001", "expressions is 10001"),
    ),
}


@pytest.mark.parametrize(
    ("system", "option", "value", "said"),
    [(system, *case) for system, cases in OUT_OF_RANGE.items() for case in cases],
)
def test_numbers_out_of_range_are_one_line(
    system: str, option: str, value: str, said: str, tmp_path: Path, avatar_train: Train
) -> None:
    code, _, err = avatar_train(system, tmp_path / "no capture", "-o", tmp_path / "out", option, value)
    assert code == 2 and said in err and err.count("\n") == 1, err


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
    (["--set", "log_every=2", "--set", "log_every=3"], "log_every is given 2 times"),
    (["--rule", "sky=black", "--rule", "sky=black"], "sky is given 2 times"),
    (["--rule", "skye=black"], "did you mean sky?"),
    (["--rule", "sky=blak"], "did you mean black?"),
    (["--rasteriser", "gpu"], "'gpu' is not one of cpu"),
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
        "about": "what is behind the cloud", "trainer_only": [],
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
