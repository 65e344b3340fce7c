"""`avatar-export pack`, and the commands that take packs."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from avatar_export.notes.note import Note
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import make_pack
from avatar_export.packing.search import Aims
from avatar_export.serving.sources import Source
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.bundle import load
from avatar_runtime.packs import read_pack
from tests.avatars import assert_same, full_avatar, surface_avatar
from tests.commands import PLAIN, Refused, Run


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("packed") / "bundle"
    avatar = replace(full_avatar(3), enhancer=None)
    write_bundle(avatar, out, preview=False, engine_files=False, reference=False)
    return out


@pytest.fixture(scope="module")
def packed(bundle: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack with two levels, its report and its reference; the coarser is kept, bad as it is."""
    out = tmp_path_factory.mktemp("packs") / "head.avatar"
    choices = Choices(levels=(1.0, 0.5))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("avatar_export.levels.height.heights_px", lambda *_: [100])
        make_pack(load(bundle), out, choices, report=out.with_suffix(".html"), reference=True)
    return out


def test_a_level_that_would_never_be_shown_is_left_out_and_said(
    bundle: Path, run: Run, tmp_path: Path
) -> None:
    out = tmp_path / "out.avatar"
    code, text, error = run("pack", bundle, "-o", out, "--levels", "1,0.1", "--no-preview")
    assert code == 0 and "left out" in error and "inside the outline" in text
    assert len(document(out)["levels"]) == 1 and load(out).packed.levels == 1


def document(path: Path) -> Any:
    return read_pack(path).document


def test_a_pack_is_small_says_its_error_and_carries_what_players_need(packed: Path, bundle: Path) -> None:
    said, pack = document(packed), read_pack(packed)
    assert packed.stat().st_size < 0.5 * (bundle / "gaussians.ply").stat().st_size + 32_000
    figures = said["error"]["psnr_mask_db"]
    assert figures["mean"] >= 59 and 54 <= figures["worst"] <= figures["mean"] - 5
    assert said["error"]["position_error"]["metres"] < 1e-3 and 0 < said["error"]["pixel_mask"] < 0.2
    assert [kind["name"] for kind in said["error"]["kinds"]] == ["ends", "mixtures", "joints", "clips"]
    assert said["levels"][1]["count"] == 24 and said["levels"][1]["height_px"] == 100
    assert said["framing"]["whole"]["size"][1] > 0 and said["avatar"]["bounds"]["swept"]
    assert pack.preview is not None and pack.preview[8:12] == b"WEBP"
    page = packed.with_suffix(".html").read_text("utf-8")
    assert "data:image/webp" in page and "http://" not in page and "https://" not in page
    source = load(bundle)
    assert pack.avatar.name == source.name and pack.avatar.expressions == source.expressions
    assert dict(pack.avatar.provenance) == dict(source.provenance)
    assert said["driving"]["inputs"] and len(said["driving"]["matrix"]) == len(said["driving"]["outputs"])


def test_commands_take_a_pack(packed: Path, run: Run, refused: Refused, tmp_path: Path) -> None:
    facts = json.loads(run("inspect", packed, "--json")[1])
    assert facts["kind"] == "pack" and [level["gaussians"] for level in facts["levels"]] == [48, 24]
    assert next(iter(facts["error"])) == "psnr_mask_db"
    assert facts["levels"][0]["psnr_mask_db"] == facts["error"]["psnr_mask_db"]
    assert run("validate", packed)[:2] == (0, f"{packed}: sound\n")
    images = []
    for level in (0, 1):
        png = tmp_path / f"{level}.png"
        assert run("render", packed, "-o", png, "--size", 64, "--level", level)[0] == 0
        images.append(np.asarray(Image.open(png)).astype(int))
    assert np.abs(images[0] - images[1]).max() > 3
    assert "the last one is level 1" in refused("render", packed, "-o", tmp_path / "2.png", "--level", 2)
    assert run("convert", packed, "-o", tmp_path / "again", *PLAIN)[0] == 0
    assert load(tmp_path / "again").gaussians.count == 48
    cut = tmp_path / "cut.avatar"
    cut.write_bytes(packed.read_bytes()[:3000])
    for command in (("inspect", cut), ("render", cut, "-o", tmp_path / "x.png")):
        assert "cut.avatar: ends" in refused(*command)
    code, out, _ = run("validate", cut)
    assert code == 1 and "error: cut.avatar: ends" in out


@pytest.mark.parametrize("backend", ["cpu", "gl"])
def test_conform_judges_stages_and_driving_of_a_pack(
    packed: Path, backend: str, run: Run, refused: Refused, tmp_path: Path
) -> None:
    code, out, err = run("conform", packed, "--backend", backend)
    assert code == 0, err
    assert f"backend {backend} repeats the reference" in out and "driving: " in out
    alone = tmp_path / "alone.avatar"
    alone.write_bytes(packed.read_bytes())
    assert "`pack --reference` writes it" in refused("conform", alone)


def test_a_budget_that_is_met_and_one_that_cannot_be(bundle: Path, run: Run, tmp_path: Path) -> None:
    met, not_met = tmp_path / "met.avatar", tmp_path / "not.avatar"
    code, out, err = run("pack", bundle, "-o", met, "--max-bytes", "30kB", "--no-preview")
    assert code == 0 and met.stat().st_size <= 30_000, (out, err)
    assert "packs were tried" in err and "bytes" in err
    code, out, err = run("pack", bundle, "-o", not_met, "--min-psnr", 119, "--no-preview")
    assert code == 1 and not_met.exists() and "nearer" in err
    assert run("validate", not_met)[0] == 0


@pytest.mark.parametrize(
    ("options", "mended"),
    [
        (("--max-bytes", "17kB"), "raise --max-bytes, or pass --min-psnr 50 in its place"),
        (("--sh-degree", "0", "--json"), "leave out --sh-degree, or raise it"),
        (("--min-psnr", "25"), "raise --min-psnr, or leave it out"),
        (("--max-bytes", "30kB"), ""),
    ],
)
def test_a_poor_picture_is_the_first_thing_that_is_said(
    options: tuple[str, ...], mended: str, bundle: Path, run: Run, tmp_path: Path
) -> None:
    code, _, error = run("pack", bundle, "-o", tmp_path / "x.avatar", "--no-preview", *options)
    first = error.splitlines()[0] if error else ""
    assert code == 0 and ("picture is poor" in error) == bool(mended)
    assert not mended or re.fullmatch(
        rf"warning: the picture is poor: mean \S+ dB, worst \S+ dB .*; {mended}", first
    )


def test_a_budget_below_the_floor_is_refused_before_the_search(
    bundle: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avatar_export.packing.make.by_size", None)
    out = tmp_path / "x.avatar"
    code, _, err = run("pack", bundle, "-o", out, "--max-bytes", "2kB", "--levels", "1,0.5")
    line = err.splitlines()[-1]
    assert code == 2 and "2000 bytes" in line and re.search(r"at least \d+ bytes", line)
    assert "clips (" in line and "--no-preview (" in line and not out.exists()


def test_exact_keeps_every_float_and_left_mirrors(bundle: Path, run: Run, tmp_path: Path) -> None:
    exact, left, fewer = (tmp_path / f"{name}.avatar" for name in ("exact", "left", "fewer"))
    assert run("pack", bundle, "-o", exact, "--exact", "--no-preview")[0] == 0
    source = with_active_sh(load(bundle))
    same = {"packed": None, "extras": {}, "provenance": {}}  # the command adds what it knows of rights
    assert_same(replace(load(exact), **same), replace(source, **same))
    assert document(exact)["error"]["psnr_mask_db"]["mean"] == 150
    assert run("pack", bundle, "-o", left, "--handedness", "left", "--no-preview")[0] == 0
    stored = load(left, as_stored=True)
    assert document(left)["avatar"]["frame"]["handedness"] == "left"
    np.testing.assert_allclose(stored.gaussians.mean * [-1, 1, 1], source.gaussians.mean, atol=2e-5)
    assert run("validate", left)[1] == f"{left}: sound, left-handed\n"
    assert run("pack", bundle, "-o", fewer, "--sh-degree", 1, "--no-preview")[0] == 0
    assert load(fewer).sh_degree == 1 and load(fewer).gaussians.sh.shape[1] == 4
    assert document(fewer)["error"]["psnr_mask_db"]["mean"] < 60


def test_convert_writes_a_pack_too_and_others_say_how_poor_it_is(
    run: Run, refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avatar_export.packing.make.POOR", Aims(200.0, 200.0))
    source, out, pack = tmp_path / "source", tmp_path / "out", tmp_path / "x.avatar"
    write_bundle(surface_avatar(3), source, preview=False, engine_files=False, reference=False)
    code, _, error = run("convert", source, "-o", out, "--pack", pack, *PLAIN)
    assert code == 0 and error.startswith("warning: the picture is poor: ")
    notes: list[Note] = []
    Source("own", source).load(noted=notes.append)
    assert [note.severity for note in notes] == ["doubt"]
    assert load(pack).gaussians.count == load(out).gaussians.count
    error = refused("convert", source, "-o", tmp_path / "other", "--pack", pack, *PLAIN)
    assert "x.avatar: exists" in error and not (tmp_path / "other").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--max-bytes", "2 parrots"), "is not a size"),
        (("--max-bytes", "0"), "is not a size"),
        (("--max-bytes", "1MB", "--min-psnr", "50"), "cannot be used together"),
        (("--exact", "--min-psnr", "50"), "cannot be used together"),
        (("--levels", "0.5"), "is not a list"),
        (("--levels", "1,0.5,0.5"), "is not a list"),
        (("--levels", "1,no"), "is not a list"),
        (("--handedness", "up"), "'up' is not one of right, left"),
        (("-o", "{}/head.avatar"), "exists"),
        (("--report", "{}/head.html"), "exists"),
        (("-o", "{}/no/x.avatar"), "its folder does not exist"),
        (("--report", "{}/no/x.html"), "its folder does not exist"),
    ],
)
def test_wrong_options_are_usage_errors(
    options: tuple[str, ...], message: str, bundle: Path, packed: Path, run: Run, tmp_path: Path
) -> None:
    before = packed.read_bytes()
    words = [word.format(packed.parent) for word in options]
    code, out, err = run("pack", bundle, "-o", tmp_path / "x.avatar", *words)
    assert (code, out) == (2, "") and message in " ".join(err.replace("│", " ").split())
    assert "drawing" not in err and not (tmp_path / "x.avatar").exists() and packed.read_bytes() == before
