"""avatar-train as somebody types it: one line and exit code 2 for whatever is wrong, before training starts."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from avatar_export.writers.bundle import write_bundle
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.describe import describe
from avatar_trainer.captures.load import load
from avatar_trainer.loop import resume
from tests.avatars import full_avatar
from tests.trainer import toy

Train = Callable[..., tuple[int, str, str]]


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
    system, settings, iteration = resume.load_run(out, moved)
    assert iteration == 6 and settings.iterations == 6 and system.table.count("cloud") == 40


def test_export_and_compare_get_the_trained_model(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[str, tuple[object, ...], dict[str, object]]] = []

    def export(system: toy.Toy, *args: object, **options: object) -> None:
        calls.append((system.name, args, options))

    saved, save = [], toy.Toy.save

    def counted(system: toy.Toy, upstream: Path, iteration: int) -> None:
        saved.append(iteration)
        save(system, upstream, iteration)

    monkeypatch.setattr(toy.Toy, "save", counted)
    monkeypatch.setattr("avatar_trainer.bundles.export.export", export)
    out, bundle = tmp_path / "out", tmp_path / "bundle"
    code, said, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", bundle)
    assert code == 0 and str(bundle) in said, err
    assert (out / "upstream" / "toy6.npz").is_file() and saved == [6]  # written once, read by the exporter
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
    monkeypatch.setattr("avatar_trainer.bundles.export.export", export)
    bundle = tmp_path / "bundle"
    again = ("toy", folder, "-o", tmp_path / "out", *SHORT, "--export", bundle)
    assert avatar_train(*again)[0] == 0 and forced == [False]
    code, said, err = avatar_train(*again)
    assert code == 0 and "exists already" in said and forced == [False], err
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

    for place in (
        "loop.checkpoint.write",
        "loop.run.write",
        "loop.train.Logs",
        "loop.train.save_upstream",
    ):
        out = tmp_path / place
        with monkeypatch.context() as patched:
            patched.setattr(f"avatar_trainer.{place}", full)
            code, _, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", tmp_path / "bundle")
        assert code == 2 and "Traceback" not in err
        assert err.splitlines()[-1] == f"avatar-train: {out}: cannot be written (No space left on device)"


def test_beginning_anew_checks_the_images_first_and_leaves_nothing_old(
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


def test_a_damaged_image_is_found_before_training(folder: Path, tmp_path: Path, avatar_train: Train) -> None:
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
    assert code == 3 and "lower --gaussians" in err and err.count("\n") == 1


def test_check_says_what_is_there(folder: Path, avatar_train: Train) -> None:
    code, said, _ = avatar_train("check", folder)
    assert code == 0 and "9 to train on, 3 held out" in said
    assert said.splitlines() == describe(load(folder)) and len(said.splitlines()) > 5, "a fact a line"


def test_advice_of_the_exporter_names_its_program(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An option that only `avatar-export` has."""
    write_bundle(full_avatar(), tmp_path / "bundle", preview=False, engine_files=False, reference=False)

    def fails(*_: object) -> None:
        raise AvatarError("pass it with --driving FILE")

    monkeypatch.setattr("avatar_trainer.commands.stability.sequences.clip", fails)
    code, _, err = avatar_train("stability", tmp_path / "bundle", "--clip", "x.csv")
    said = "`stability` has no --driving: run `avatar-export pack` with it first, and give `stability` what it writes"
    assert (code, err) == (2, f"avatar-train: pass it with --driving FILE; {said}\n")
