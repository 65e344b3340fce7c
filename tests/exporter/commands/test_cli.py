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
from tests.commands import PLAIN, Refused, Run


@pytest.fixture(scope="module")
def bundle(sample_blendshapes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cli") / "head"
    words = ("convert", sample_blendshapes / "model", "-o", out, "--dataset", sample_blendshapes)
    words += ("--driving", sample_blendshapes / "driving.json")
    command = [sys.executable, "-m", "avatar_export", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert str(out) in done.stdout
    assert "\x1b" not in done.stdout + done.stderr  # quiet when piped: no spinner, no colour
    return out


def test_convert_writes_every_file(bundle: Path, refused: Refused, sample_lam: Path) -> None:
    assert {p.name for p in bundle.iterdir()} == {
        *("avatar.json", "gaussians.ply", "blendshapes.safetensors", "rig.safetensors", "rig.glb"),
        *("splats.glb", "rig.usdc", "avatar.usdz", "preview.png", "reference"),
    }
    assert np.asarray(Image.open(bundle / "preview.png")).std() > 5
    avatar = load(bundle)
    assert avatar.driving.mode == "matrix" and avatar.provenance["licence"] is None
    before = (bundle / "avatar.json").read_bytes()
    assert "--force" in refused("convert", sample_lam, "-o", bundle)
    assert (bundle / "avatar.json").read_bytes() == before


def test_convert_json_and_rights(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    out = tmp_path / "lam.avatar.zip"
    _, text, _ = run("convert", sample_lam, "-o", out, "--json", *PLAIN, "--licence", "CC BY 4.0")
    facts = json.loads(text)
    assert (facts["system"], facts["gaussians"]) == ("lam", load(out).gaussians.count)
    assert load(out).provenance["licence"] == "CC BY 4.0"


def test_bad_source_is_one_line(refused: Refused, sample_lam: Path, bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "junk").mkdir()
    to = ("-o", tmp_path / "out")
    for words, said in (
        (("convert", tmp_path / "absent", *to), "no such file"),
        (("convert", tmp_path / "junk", *to), "systems"),
        (("convert", sample_lam, "-o", tmp_path / ("y" * 300)), "too long"),
        (("inspect", "x" * 300), "too long"),
        (("render", sample_lam, *to), "is a trained lam avatar"),
        (("validate", sample_lam), "convert"),
        (("convert", bundle, *to, "--body-model", bundle / "rig.glb"), "--body-model cannot be used here"),
    ):
        assert said in refused(*words)
        assert not (tmp_path / "out").exists()


def test_without_a_body_model(run: Run, refused: Refused, sample_blendshapes: Path, tmp_path: Path) -> None:
    words = ("convert", sample_blendshapes / "model", "-o", tmp_path / "out", *PLAIN)
    error = refused(*words)
    assert "--body-model" in error and "--no-rig" in error
    code, _, error = run(*words, "--no-rig")
    assert code == 0 and "expressions" in error


def test_inspect(run: Run, bundle: Path, sample_blendshapes: Path, sample_lam: Path) -> None:
    facts = json.loads(run("inspect", bundle, "--json")[1])
    assert (facts["kind"], facts["driving"]["unreached"]) == ("bundle", ["tongueOut"])
    rig = load(bundle).rig
    assert rig is not None and rig.correctives.entries > 0
    assert facts["rig"]["mesh_deltas"]["correctives"].startswith(f"{rig.correctives.entries} of ")
    text = run("inspect", bundle)[1]
    (case, *_) = json.loads((bundle / "avatar.json").read_text("utf-8"))["reference"]["cases"]
    assert f"{case['engine_psnr_db']:.1f} dB" in facts["reference"][case["name"]]
    source_file = facts["provenance"]["source_files"][0]["path"]
    assert "rules.rotation" in text and source_file in "".join(text.split()) and "sha256" not in text
    for source, system in ((sample_blendshapes / "model", "gaussian_blendshapes"), (sample_lam, "lam")):
        assert json.loads(run("inspect", source, "--json")[1])["system"] == system


def test_validate(run: Run, bundle: Path, tmp_path: Path) -> None:
    code, text, _ = run("validate", bundle)
    assert code == 0 and "sound" in text
    broken = Path(shutil.copytree(bundle, tmp_path / "broken"))
    data = (broken / "gaussians.ply").read_bytes()
    (broken / "gaussians.ply").write_bytes(data[:-4] + b"\0\0\0\0")
    code, text, _ = run("validate", broken, "--json")
    assert code == 1
    assert any("gaussians.ply" in p["path"] + p["message"] for p in json.loads(text))


def test_systems(run: Run) -> None:
    assert [s["system"] for s in json.loads(run("systems", "--json")[1])] == [
        *("bundle", "gaussian_blendshapes", "splatting_avatar", "gaussian_avatars"),
        *("psavatar", "lam", "rgbavatar", "lhm", "asm"),
    ]
    assert "skin.glb" in run("systems")[1]


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
        assert code == 0 and "96x64" in text
        images[name] = np.asarray(Image.open(out)).astype(int)
        assert images[name].shape == (64, 96, 3)
        assert name == "neutral" or np.abs(images[name] - images["neutral"]).max() > 8, name


MOVES_NOTHING = "note: this avatar has nothing that tongueOut moves\n"


def test_an_arkit_name_that_moves_nothing_is_said(run: Run, bundle: Path, tmp_path: Path) -> None:
    for command, out in (("render", tmp_path / "x.png"), ("pose", tmp_path / "x.json")):
        size = ("--size", "16") if command == "render" else ()
        for names, said in ((("tongue_out", "jawOpen"), True), (("jawOpen",), False)):
            words = [word for name in names for word in ("-a", f"{name}=1")]
            code, _, error = run(command, bundle, "-o", out, *size, *words, "--force")
            assert code == 0 and (error == MOVES_NOTHING) == said


TAKES = Path(__file__).parents[3] / "samples" / "drive"
ROM = ("--drive", TAKES / "live_link_face_rom_300.csv", "--every", "100")


@pytest.mark.parametrize(
    ("flags", "images", "milliseconds"),
    [
        (ROM, 3, None),
        ((*ROM, "--frames", "100:201"), 2, None),  # of the recording: 100 and 200
        (("--drive", TAKES / "live_link_face_udp.gesichter", "--every", "30", "--frames", "30:91"), 3, 500),
        (("--orbit", "360", "--fps", "3", "-a", "jawOpen=1"), 6, None),
        (("--idle", "3", "--fps", "1", "--seed", "1", "--zoom", "3"), 3, 1000),
    ],
)
def test_render_what_moves(
    run: Run, bundle: Path, tmp_path: Path, flags: tuple[object, ...], images: int, milliseconds: int | None
) -> None:
    words = ("render", bundle, "--size", "16", *flags, "-o")
    code, text, error = run(*words, tmp_path / "take.webp")
    assert code == 0 and f"{images} images" in text and ("tongueOut" in error) == (flags[:1] == ROM[:1])
    with Image.open(tmp_path / "take.webp") as animation:
        assert animation.n_frames == images
        animation.seek(1)
        animation.load()
        assert milliseconds in (None, animation.info["duration"])
    assert run(*words, tmp_path / "frames")[0] == 0
    names = sorted(p.name for p in (tmp_path / "frames").iterdir())
    assert names == [f"frame_{i:05}.png" for i in range(images)]


def test_commands_say_what_a_recording_lacks_after_what_is_wrong_in_it(
    run: Run, bundle: Path, tmp_path: Path
) -> None:
    take, still = tmp_path / "take.csv", (tmp_path / "a.webp", "--size", "16")
    take.write_text("Timecode,JawOpen,TongueOut\n00:00:00:00.0,80,0\n00:00:00:01.0,0,0\n")
    for words in (
        ("render", bundle, "-o", *still, "--drive", take),
        ("render", bundle, "-o", *still, "--force", "--clip", take),
        ("convert", bundle, "-o", tmp_path / "out", *PLAIN, "--clip", take),
    ):
        code, _, error = run(*words)
        first, *others = error.splitlines()
        assert code == 0 and first.startswith(
            "warning: take.csv: jawOpen is 80 in frame 0: are the weights percent?"
        )
        assert any(
            "take.csv lacks 50 of the 52 ARKit names, which stay 0: eyeBlinkLeft, " in line for line in others
        )
    error = run("convert", bundle, "-o", tmp_path / "out", *PLAIN, "--force", "--clip", take, "--json")[2]
    assert error.startswith("warning: take.csv: jawOpen is 80") and error.count("\n") == 1


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


def test_inspect_of_a_broken_manifest_is_one_line(refused: Refused, tmp_path: Path) -> None:
    for text in ("{", "[]", '{"asset": {}}', '{"asset": 3, "files": [1]}', ""):
        (tmp_path / "avatar.json").write_text(text)
        assert "avatar.json" in refused("inspect", tmp_path)


def test_pipes_on_the_command_line_are_refused(
    run: Run, sample_blendshapes: Path, bundle: Path, tmp_path: Path
) -> None:
    pipe, out = tmp_path / "pipe", tmp_path / "out"
    os.mkfifo(pipe)
    calls = [("convert", pipe, "-o", out), ("inspect", pipe), ("render", pipe, "-o", out)]
    calls += [("render", bundle, "-o", out, option, pipe) for option in ("--drive", "--clip")]
    whole = ("convert", sample_blendshapes / "model", "-o", out, "--dataset", sample_blendshapes)
    options = ("--body-model", "--shape", "--anchor-faces", "--driving")
    calls += [(*whole, option, pipe) for option in options]
    model = shutil.copytree(sample_blendshapes / "model", tmp_path / "model")
    (model / "acc40000.npy").unlink()
    os.mkfifo(model / "acc40000.npy")
    calls += [("convert", model / "fix_chkpnt40000.pth", "-o", out, "--no-rig")]
    assert [call for call in calls if run(*call)[0] != 2] == [] and run("validate", pipe)[0] == 1
    assert not out.exists()


def test_render_on_a_backend(
    run: Run, refused: Refused, bundle: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one that is named draws, and a profile that it does not draw is refused."""
    made = []
    monkeypatch.setattr(reference, "make", lambda a: made.append(a) or reference.ReferenceBackend(a))
    words = ("render", bundle, "--backend", "reference", "--size", "32", "-o")
    assert run(*words, tmp_path / "a.png", "--profile", "trainer")[0] == 0 and len(made) == 1
    monkeypatch.setattr(reference.ReferenceBackend, "profiles", ("engine",))
    assert run(*words, tmp_path / "b.png")[0] == 0, "its own profile is the default"
    error = refused(*words, tmp_path / "c.png", "--profile", "trainer")
    assert "profile trainer" in error and "choose engine" in error
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
