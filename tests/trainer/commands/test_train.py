"""avatar-train as somebody types it: one line and exit code 2 for whatever is wrong, before training starts."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable
from dataclasses import replace
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
    system, settings, iteration, _ = resume.load_run(out, moved)
    assert iteration == 6 and settings.iterations == 6 and system.table.count("cloud") == 40


def test_the_trained_model_is_exported_once(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[Path, dict[str, bool]]] = []

    def export(system: toy.Toy, upstream: Path, bundle: Path, **options: bool) -> None:
        calls.append((upstream, options))
        plain = {"preview": False, "engine_files": False, "reference": False}
        write_bundle(full_avatar(), bundle, **plain, force=options["force"])

    monkeypatch.setattr("avatar_trainer.bundles.export.export", export)
    out, bundle = tmp_path / "out", tmp_path / "bundle"
    again = ("toy", folder, "-o", out, *SHORT, "--export", bundle)
    code, said, err = avatar_train(*again)
    assert code == 0 and str(bundle) in said and calls == [(out / "upstream", {"force": False})], err
    assert (out / "upstream" / "toy6.npz").is_file()
    code, said, err = avatar_train(*again)
    assert code == 0 and "exists already" in said and len(calls) == 1, err
    assert avatar_train(*again, "--force")[0] == 0 and calls[-1][1] == {"force": True}
    assert avatar_train("export", out, bundle, "--no-preview", "--force")[0] == 0
    assert calls[-1][1] == {"engine_files": True, "preview": False, "force": True}
    code, _, err = avatar_train(*again, "--no-resume")
    assert code == 2 and "exists; pass --force" in err and (out / "evaluation.json").is_file()
    code, _, err = avatar_train("compare", out, tmp_path / "none")
    assert code == 2 and err.count("\n") == 1


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
    for name in (parts := ("checkpoints", "logs", "upstream", "preview")):
        (tmp_path / f"with_{name}").mkdir()
        (tmp_path / f"with_{name}" / name).write_text("")
    bundles = [
        *((place, "overlap") for place in (out, out / "bundle", tmp_path)),
        *((place, "exists; pass --force") for place in (file, photos)),
        (file / "bundle", "is a file"),
        (closed / "deeper" / "bundle", "no permission"),
    ]
    for options, said in [
        *((("-o", out, "--export", place), said) for place, said in bundles),
        (("-o", out, "--export", photos, "--force"), "is not a bundle"),
        *((("-o", tmp_path / f"with_{name}"), f"with_{name}/{name}: is a file") for name in parts),
        *((("-o", place), "is a file") for place in (file, file / "run")),
        (("-o", closed / "a" / "b"), "no permission"),
    ]:
        code, _, err = avatar_train("toy", folder, *SHORT, *options)
        assert code == 2 and said in err and err.count("\n") == 1 and not out.exists(), err


def test_a_full_disk_is_one_line_that_names_the_run(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for place in ("loop.checkpoint.write", "loop.run.write", "loop.train.Logs", "loop.train.save_upstream"):
        out = tmp_path / place
        with monkeypatch.context() as patched:
            patched.setattr(f"avatar_trainer.{place}", full)
            code, _, err = avatar_train("toy", folder, "-o", out, *SHORT, "--export", tmp_path / "bundle")
        assert code == 2 and "Traceback" not in err
        assert err.splitlines()[-1] == f"avatar-train: {out}: cannot be written (No space left on device)"


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


def test_check_says_what_is_there(folder: Path, avatar_train: Train) -> None:
    code, said, _ = avatar_train("check", folder)
    assert code == 0 and "9 to train on, 3 held out" in said
    assert said.splitlines() == describe(load(folder)) and len(said.splitlines()) > 5, "a fact a line"


def test_advice_of_the_exporter_names_its_program(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_bundle(full_avatar(), tmp_path / "bundle", preview=False, engine_files=False, reference=False)

    def fails(*_: object) -> None:
        raise AvatarError("pass it with --driving FILE")

    monkeypatch.setattr("avatar_trainer.commands.stability.sequences.clip", fails)
    code, _, err = avatar_train("stability", tmp_path / "bundle", "--clip", "x.csv")
    said = "`stability` has no --driving: run `avatar-export pack` with it first, and give `stability` what it writes"
    assert (code, err) == (2, f"avatar-train: pass it with --driving FILE; {said}\n")


def test_stability_says_what_a_recording_lacks(tmp_path: Path, avatar_train: Train) -> None:
    plain, take = full_avatar(), tmp_path / "take.csv"
    clips = tuple(
        replace(clip, name=name) for clip, name in zip(plain.clips, ("training", "held_out"), strict=True)
    )
    bundle = tmp_path / "bundle"
    write_bundle(replace(plain, clips=clips), bundle, preview=False, engine_files=False, reference=False)
    rows = [f"00:00:00:{k:02}.0,0.{k}" for k in range(3)]
    take.write_text("\n".join(("Timecode,JawOpen", *rows)))
    code, _, err = avatar_train("stability", bundle, "--clip", take)
    assert code == 0 and "take.csv lacks 6 of the 52 ARKit names, which stay 0: eyeBlinkLeft, eyeLook" in err
