"""The command line as a user meets it: what it writes, prints and exits with."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.backends import reference
from avatar_runtime.bundle import load
from tests import bundles
from tests.commands import Run

PLAIN = ("--no-preview", "--no-engine-files", "--no-reference")


@pytest.fixture(scope="module")
def bundle(sample_blendshapes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cli") / "head"
    command = [
        sys.executable,
        "-m",
        "avatar_export",
        "convert",
        str(sample_blendshapes / "model"),
        "-o",
        str(out),
    ]
    command += ["--dataset", str(sample_blendshapes), "--driving", str(sample_blendshapes / "driving.json")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert str(out) in done.stdout
    assert "\x1b" not in done.stdout + done.stderr  # quiet when piped: no spinner, no colour
    return out


def test_convert_writes_every_file(bundle: Path) -> None:
    names = {p.name for p in bundle.iterdir()}
    assert names == {
        "avatar.json",
        "gaussians.ply",
        "blendshapes.safetensors",
        "rig.safetensors",
        "rig.glb",
        "splats.glb",
        "rig.usdc",
        "avatar.usdz",
        "preview.png",
        "reference",
    }
    assert np.asarray(Image.open(bundle / "preview.png")).std() > 5
    avatar = load(bundle)
    assert avatar.driving.mode == "matrix"
    assert avatar.provenance["licence"] is None


def test_convert_refuses_to_overwrite(run: Run, bundle: Path, sample_lam: Path) -> None:
    before = (bundle / "avatar.json").read_bytes()
    code, _, error = run("convert", sample_lam, "-o", bundle)
    assert code == 2
    assert "--force" in error
    assert (bundle / "avatar.json").read_bytes() == before


def test_convert_json_and_rights(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    out = tmp_path / "lam.avatar.zip"
    code, text, _ = run("convert", sample_lam, "-o", out, "--json", *PLAIN, "--licence", "CC BY 4.0")
    assert code == 0
    facts = json.loads(text)
    assert facts["system"] == "lam"
    assert facts["gaussians"] == load(out).gaussians.count
    assert load(out).provenance["licence"] == "CC BY 4.0"


def test_bad_source_is_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "junk").mkdir()
    for source, words in ((tmp_path / "absent", "no such file"), (tmp_path / "junk", "systems")):
        code, out, error = run("convert", source, "-o", tmp_path / "out")
        assert (code, out) == (2, "")
        assert error.count("\n") == 1
        assert words in error
        assert not (tmp_path / "out").exists()


def test_without_a_body_model(run: Run, sample_blendshapes: Path, tmp_path: Path) -> None:
    source = sample_blendshapes / "model"
    code, _, error = run("convert", source, "-o", tmp_path / "out")
    assert code == 2
    assert "--body-model" in error
    assert "--no-rig" in error
    code, _, error = run("convert", source, "-o", tmp_path / "out", "--no-rig", *PLAIN)
    assert code == 0
    assert "only expressions move" in error


def test_raw_and_dump_give_the_same_gaussians(
    run: Run, sample_blendshapes: Path, bundle: Path, tmp_path: Path
) -> None:
    source = sample_blendshapes / "model" / "fix_chkpnt40000.pth"
    driving = sample_blendshapes / "driving.json"
    flags = ("--dataset", sample_blendshapes, "--driving", driving, *PLAIN, "--name", "head")
    code, _, error = run("convert", source, "-o", tmp_path / "raw", *flags)
    assert code == 0
    assert "3 rows with a NaN or infinity were dropped" in error
    for name in ("gaussians.ply", "blendshapes.safetensors", "rig.safetensors"):
        assert (tmp_path / "raw" / name).read_bytes() == (bundle / name).read_bytes()


def test_inspect(run: Run, bundle: Path, sample_blendshapes: Path, sample_lam: Path) -> None:
    code, text, _ = run("inspect", bundle, "--json")
    facts = json.loads(text)
    assert code == 0
    assert facts["kind"] == "bundle"
    assert facts["driving"]["unreached"] == ["tongueOut"]
    rig = load(bundle).rig
    assert rig is not None and rig.correctives.entries > 0
    assert facts["rig"]["mesh_deltas"]["correctives"].startswith(f"{rig.correctives.entries} of ")
    code, text, _ = run("inspect", bundle)
    assert code == 0
    assert "rules.rotation" in text
    (case, *_) = json.loads((bundle / "avatar.json").read_text("utf-8"))["reference"]["cases"]
    assert facts["reference"][case["name"]] == f"engine against trainer {case['engine_psnr_db']:.1f} dB"
    source_file = facts["provenance"]["source_files"][0]["path"]
    assert source_file in "".join(text.split()) and "sha256" not in text
    for source, system in ((sample_blendshapes / "model", "gaussian_blendshapes"), (sample_lam, "lam")):
        code, text, _ = run("inspect", source, "--json")
        assert code == 0
        assert json.loads(text)["system"] == system


def test_validate(run: Run, bundle: Path, tmp_path: Path) -> None:
    code, text, _ = run("validate", bundle)
    assert code == 0
    assert "sound" in text
    broken = Path(shutil.copytree(bundle, tmp_path / "broken"))
    data = (broken / "gaussians.ply").read_bytes()
    (broken / "gaussians.ply").write_bytes(data[:-4] + b"\0\0\0\0")
    code, text, _ = run("validate", broken, "--json")
    assert code == 1
    assert any("gaussians.ply" in p["path"] + p["message"] for p in json.loads(text))


def test_systems(run: Run) -> None:
    code, text, _ = run("systems", "--json")
    assert code == 0
    assert [s["system"] for s in json.loads(text)] == [
        *("bundle", "gaussian_blendshapes", "splatting_avatar", "gaussian_avatars"),
        *("psavatar", "lam", "rgbavatar", "lhm", "asm"),
    ]
    text = run("systems")[1]
    assert "skin.glb" in text
    assert text.count("--rig (.glb, .fbx, ASM face .npz)") == 2, "of SplattingAvatar and GaussianAvatars"


def test_render_one_pose(run: Run, bundle: Path, tmp_path: Path) -> None:
    images = {}
    flags = {
        "neutral": (),
        "arkit": ("-a", "JawOpen=0.8"),
        "expression": ("-e", "mouthSmileLeft=1"),
        "joint": ("-j", "jaw=20,0,0"),
        "eyelid": ("--eyelid", "left=1"),
        "turned": ("--yaw", "60"),
    }
    for name, extra in flags.items():
        out = tmp_path / f"{name}.png"
        code, text, _ = run("render", bundle, "-o", out, "--size", "96x64", *extra)
        assert code == 0
        assert "96x64" in text
        images[name] = np.asarray(Image.open(out)).astype(int)
        assert images[name].shape == (64, 96, 3)
    for name in list(flags)[1:]:
        assert np.abs(images[name] - images["neutral"]).max() > 8, name


def test_render_background(run: Run, bundle: Path, tmp_path: Path) -> None:
    run("render", bundle, "-o", tmp_path / "clear.png", "--size", "48", "--background", "transparent")
    clear = np.asarray(Image.open(tmp_path / "clear.png"))
    assert clear.shape == (48, 48, 4)
    assert clear[0, 0, 3] == 0
    assert clear[..., 3].max() > 250
    run("render", bundle, "-o", tmp_path / "green.png", "--size", "48", "--background", "0,1,0")
    assert np.asarray(Image.open(tmp_path / "green.png"))[0, 0].tolist() == [0, 255, 0]


def test_render_a_recording(run: Run, bundle: Path, tmp_path: Path) -> None:
    take = Path(__file__).parents[3] / "samples" / "drive" / "live_link_face_rom_300.csv"
    common = ("--drive", take, "--every", "100", "--size", "32")
    code, text, error = run("render", bundle, "-o", tmp_path / "take.webp", *common)
    assert code == 0
    assert "3 images" in text
    assert "tongueOut" in error
    with Image.open(tmp_path / "take.webp") as animation:
        assert getattr(animation, "n_frames", 1) == 3
    code, _, _ = run("render", bundle, "-o", tmp_path / "frames", *common, "--frames", "100:201")
    assert code == 0, "of the recording: 100 and 200"
    assert sorted(p.name for p in (tmp_path / "frames").iterdir()) == ["frame_00000.png", "frame_00001.png"]


def test_wrong_kind_of_input_is_named(run: Run, bundle: Path, sample_lam: Path, tmp_path: Path) -> None:
    code, _, error = run("render", sample_lam, "-o", tmp_path / "x.png")
    assert (code, "is a trained lam avatar" in error) == (2, True)
    code, _, error = run("validate", sample_lam)
    assert (code, "convert" in error) == (2, True)


def test_a_bundle_is_completed_from_its_normative_files(run: Run, bundle: Path, tmp_path: Path) -> None:
    listed = json.loads((bundle / "avatar.json").read_text())["files"]
    bare = tmp_path / "bare"
    assert run("convert", bundle, "-o", bare, *PLAIN)[0] == 0
    normative = {entry["path"] for entry in listed if not entry["derived"]}
    assert {p.name for p in bare.iterdir()} == normative | {"avatar.json"}
    assert run("convert", bare, "-o", tmp_path / "whole", "--no-preview")[0] == 0
    before, after = bundles.contents(bundle), bundles.contents(tmp_path / "whole")
    assert set(before) - set(after) == {"preview.png"}
    assert [name for name in after if after[name] != before[name]] == ["avatar.json"], "sound, as `bundle` is"
    listed_after = json.loads(after["avatar.json"])["files"]
    assert listed_after == [entry for entry in listed if entry["path"] != "preview.png"]
    code, _, error = run("convert", bundle, "-o", tmp_path / "x", "--body-model", bundle / "rig.glb")
    assert (code, "--body-model cannot be used here" in error) == (2, True)


def test_driving_is_found_in_the_data_set(run: Run, sample_blendshapes: Path, tmp_path: Path) -> None:
    source = sample_blendshapes / "model"
    assert run("convert", source, "-o", tmp_path / "found", "--dataset", sample_blendshapes, *PLAIN)[0] == 0
    assert load(tmp_path / "found").driving.mode == "matrix"
    body = sample_blendshapes / "body"
    flags = ("--body-model", body / "body_model.npz", "--shape", body / "shape.npy")
    flags += ("--anchor-faces", body / "back_of_head.txt")
    code, _, error = run("convert", source, "-o", tmp_path / "named", *flags, *PLAIN)
    assert code == 0
    assert "the jaw is a joint" in error
    assert "no eyelid files" in error


def test_turntable(run: Run, bundle: Path, tmp_path: Path) -> None:
    flags = ("--orbit", "360", "--fps", "3", "--size", "24", "-a", "jawOpen=1")
    code, text, _ = run("render", bundle, "-o", tmp_path / "round.webp", *flags)
    assert code == 0
    assert "6 images" in text


def test_zoom_pitch_and_transparency(run: Run, bundle: Path, tmp_path: Path) -> None:
    def drawn(name: str, *flags: str) -> np.ndarray:
        out = tmp_path / f"{name}.png"
        assert run("render", bundle, "-o", out, "--size", "96", "--background", "transparent", *flags)[0] == 0
        return np.asarray(Image.open(out)).astype(float)

    plain, near = drawn("plain"), drawn("near", "--zoom", "1.5")
    covered = [np.count_nonzero(image[..., 3] > 128) for image in (plain, near)]
    assert covered[1] > 1.5 * covered[0]
    # Straight alpha: a half covered rim pixel keeps the skin's colour instead of darkening towards black.
    rim = plain[(plain[..., 3] > 90) & (plain[..., 3] < 160)]
    inside = plain[plain[..., 3] > 250]
    assert rim[:, 0].mean() > 0.7 * inside[:, 0].mean()


def test_frames_and_frame_rate(run: Run, bundle: Path, tmp_path: Path) -> None:
    take = Path(__file__).parents[3] / "samples" / "drive" / "live_link_face_udp.gesichter"
    flags = ("--drive", take, "--every", "30", "--size", "16", "--frames", "30:91")
    assert "3 images" in run("render", bundle, "-o", tmp_path / "t.webp", *flags)[1]
    with Image.open(tmp_path / "t.webp") as animation:
        animation.seek(1)
        animation.load()
        assert animation.info["duration"] == 500  # 60 frames a second, each thirtieth


@pytest.mark.parametrize("name", ["x[/y]", "[red]x", "\x1b[31mx"])
def test_a_name_is_text_and_no_markup(run: Run, sample_lam: Path, tmp_path: Path, name: str) -> None:
    assert run("convert", sample_lam, "-o", tmp_path / "a", "--name", name, *PLAIN)[0] == 0
    code, text, _ = run("inspect", tmp_path / "a")
    assert code == 0
    assert name.replace("\x1b", "?") in text
    assert "\x1b" not in text


def test_inspect_of_a_broken_manifest_is_one_line(run: Run, bundle: Path, tmp_path: Path) -> None:
    shutil.copytree(bundle, tmp_path / "b")
    for text in ("{", "[]", '{"asset": {}}', '{"asset": 3, "files": [1]}', ""):
        (tmp_path / "b" / "avatar.json").write_text(text)
        code, _, error = run("inspect", tmp_path / "b")
        assert (code, error.count("\n")) == (2, 1)
        assert "avatar.json" in error


def test_names_that_no_system_takes(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    for arguments in (("inspect", "x" * 300), ("convert", sample_lam, "-o", tmp_path / ("y" * 300))):
        code, _, error = run(*arguments)
        assert (code, error.count("\n")) == (2, 1)


def test_force_goes_through_a_link(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    assert run("convert", sample_lam, "-o", tmp_path / "real", *PLAIN)[0] == 0
    (tmp_path / "link").symlink_to(tmp_path / "real")
    assert run("convert", sample_lam, "-o", tmp_path / "link", *PLAIN, "--force", "--name", "new")[0] == 0
    assert (tmp_path / "link").is_symlink()
    assert load(tmp_path / "real").name == "new"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "real"]


@pytest.mark.parametrize("file", ["fix_chkpnt40000/W.npy", "mouth0_chkpnt40000/pos.npy", "acc40000.npy"])
def test_a_pipe_among_the_files_is_refused(
    run: Run, sample_blendshapes: Path, tmp_path: Path, file: str
) -> None:
    """Opening a pipe would wait for a writer for ever."""
    shutil.copytree(sample_blendshapes / "model", tmp_path / "model")
    (tmp_path / "model" / file).unlink()
    os.mkfifo(tmp_path / "model" / file)
    source = tmp_path / "model" / ("fix_chkpnt40000.pth" if file.startswith("acc") else "")
    code, _, error = run("convert", source, "-o", tmp_path / "out", "--no-rig")
    assert code == 2
    assert error.count("\n") == 1
    assert "regular file" in error or "is missing" in error


OPTIONS_WITH_A_FILE = ("--body-model", "--shape", "--anchor-faces", "--driving")


def test_pipes_on_the_command_line_are_refused(
    run: Run, sample_blendshapes: Path, bundle: Path, tmp_path: Path
) -> None:
    pipe, out = tmp_path / "pipe", tmp_path / "out"
    os.mkfifo(pipe)
    for verb in (("convert", pipe, "-o", out), ("inspect", pipe), ("render", pipe, "-o", out)):
        assert run(*verb)[0] == 2
    assert run("validate", pipe)[0] == 1
    for option in ("--drive", "--clip"):
        assert run("render", bundle, "-o", out, option, pipe)[0] == 2
    for option in OPTIONS_WITH_A_FILE:
        flags = ("--dataset", sample_blendshapes, option, pipe)
        assert run("convert", sample_blendshapes / "model", "-o", out, *flags)[0] == 2, option
    assert not out.exists()


def test_render_on_a_backend(run: Run, bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that is named draws, and a profile that it does not draw is refused."""
    made = []
    monkeypatch.setattr(reference, "make", lambda a: made.append(a) or reference.ReferenceBackend(a))
    flags = ("--backend", "reference", "--size", "32", "-o")
    assert run("render", bundle, *flags, tmp_path / "a.png", "--profile", "trainer")[0] == 0
    assert len(made) == 1
    monkeypatch.setattr(reference.ReferenceBackend, "profiles", ("engine",))
    assert run("render", bundle, *flags, tmp_path / "b.png")[0] == 0, "its own profile is the default"
    code, _, error = run("render", bundle, *flags, tmp_path / "c.png", "--profile", "trainer")
    assert code == 2 and "profile trainer: is not supported by backend reference; choose engine" in error
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png"]
    first, second = (np.asarray(Image.open(tmp_path / name)) for name in ("a.png", "b.png"))
    assert first.std() > 5 and (first != second).any()


USER_ERRORS = {
    "unknown expression": (("-e", "jawOpenn=1"), "did you mean jawOpen"),
    "unknown ARKit name": (("-a", "eyeBlinkLeftt=1"), "eyeBlinkLeft"),
    "unknown joint": (("-j", "head=1,0,0"), "is not a joint"),
    "not a pair": (("-e", "jawOpen"), "--expression / -e: 'jawOpen' is not NAME=VALUE"),
    "no ARKit pair": (("-a", "jawOpen"), "--arkit / -a: 'jawOpen' is not NAME=VALUE"),
    "no eyelid pair": (("--eyelid", "left"), "--eyelid: 'left' is not NAME=VALUE"),
    "not a number": (("-e", "jawOpen=wide"), "--expression / -e: 'wide' is not 1 finite number"),
    "two of three numbers": (("-j", "jaw=1,2"), "--joint / -j: '1,2' is not 3 finite numbers"),
    "not finite": (("-e", "jawOpen=nan"), "finite"),
    "size": (("--size", "0"), "pixels"),
    "profile": (("--profile", "best"), "trainer"),
    "backend": (("--backend", "cuda"), "reference"),
    "absent recording": (("--drive", "nowhere.csv"), "nowhere.csv"),
    "frames of one image": (("--frames", "9:10"), "one image"),
    "frames beyond the end": (("--frames", "99:", "--orbit", "9", "-o", "x.webp"), "no frame"),
    "superscript size": (("--size", "\u00b2"), "WxH"),
    "endless size": (("--size", "9" * 5000), "WxH"),
    "yaw": (("--yaw", "nan"), "finite"),
    "background": (("--background", "255,0,0"), "0 to 1"),
    "two sources": (("--drive", "a.csv", "-a", "jawOpen=1"), "cannot be used together"),
    "kind of file": (("-o", "film.mp4"), ".mp4 files cannot be written"),
}


@pytest.mark.parametrize("name", USER_ERRORS)
def test_render_user_errors(run: Run, bundle: Path, tmp_path: Path, name: str) -> None:
    flags, words = USER_ERRORS[name]
    code, _, error = run("render", bundle, "-o", tmp_path / "x.png", *flags)
    assert code == 2
    assert words in error
    assert not list(tmp_path.iterdir())


def test_two_conversions_give_the_same_bytes(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    """Read twice. The tests of the writer show that one avatar gives the same preview and reference."""
    parts = ("--no-preview", "--no-reference")
    for name in ("a", "b"):
        assert run("convert", sample_lam, "-o", tmp_path / name, "--name", "head", *parts)[0] == 0
    first, second = (bundles.contents(tmp_path / name) for name in ("a", "b"))
    assert list(first) == list(second)
    for name, data in first.items():
        assert data == second[name], name
