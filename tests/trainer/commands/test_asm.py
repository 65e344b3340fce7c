"""`avatar-train asm scan` as somebody types it: a face from scan files, and one line for whatever is wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from avatar_export.asm.files import load, save
from avatar_export.asm.model import AsmFace, Take
from avatar_runtime.bundle import load as load_bundle
from avatar_trainer.commands import asm
from tests.trainer.asm.toy import PLACES, binding, changed, grid, template

Command = Callable[..., tuple[int, str, str]]
QUICK = ("--set", "iterations=40", "--set", "learning_rate=5e-3")


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """template.npz, scan.obj and smile.ply in millimetres, scan.glb in metres, their keypoints."""
    of = template(17)
    still = np.zeros((1, len(of.bone_names), 3))
    save(
        AsmFace("toy", of, binding(of), (Take("neutral", 30.0, still, still, still + 1),)),
        tmp_path / "template.npz",
    )
    uv, triangles = grid(41)
    for name, unit, change in (("scan.obj", 1000, 1.0), ("smile.ply", 1000, 3.0), ("scan.glb", 1, 1.0)):
        mesh = trimesh.Trimesh(changed(uv, change) * unit, triangles, process=False)
        mesh.export(tmp_path / name)
    marks = changed(np.array(list(PLACES.values())), 1.0)
    for name, unit in (("keypoints.json", 1000), ("metres.json", 1)):
        places = {key: (unit * at).tolist() for key, at in zip(PLACES, marks, strict=True)}
        (tmp_path / name).write_text(json.dumps(places))
    return tmp_path


def given(files: Path, scan: str = "scan.obj") -> tuple[object, ...]:
    return (
        *(files / scan, "--template", files / "template.npz"),
        *("--keypoints", files / "keypoints.json", "--units", 1000, *QUICK),
    )


def test_a_scan_and_an_expression_become_a_face(avatar_train: Command, files: Path) -> None:
    code, out, err = avatar_train(
        "asm", "scan", *given(files), "--expression", files / "smile.ply", "-o", files / "sub" / "face.npz"
    )
    assert (code, err) == (0, "")
    face = load(files / "sub" / "face.npz")
    assert [take.name for take in face.takes] == ["neutral", "smile"]
    assert face.name == "scan"
    assert [path.name for path in (files / "sub").iterdir()] == ["face.npz"]
    words = out.split()
    errors = [float(words[i - 1]) for i, word in enumerate(words) if word == "mm"]
    assert len(errors) == 2 and max(errors) < 0.4


def test_the_bundle_holds_the_face(avatar_train: Command, files: Path) -> None:
    code, _, err = avatar_train(
        "asm",
        "scan",
        *given(files),
        "-o",
        files / "face.npz",
        "--export",
        files / "face.avatar",
        "--components",
        2,
    )
    assert (code, err) == (0, "")
    avatar = load_bundle(files / "face.avatar")
    assert avatar.rig is not None and len(avatar.rig.joint_names) == len(
        load(files / "face.npz").template.bone_names
    )


def one_line(code: int, err: str, *parts: str) -> None:
    assert code == 2
    assert len(err.strip().splitlines()) == 1
    for part in parts:
        assert part in err


def test_what_is_there_is_not_overwritten(avatar_train: Command, files: Path) -> None:
    out = files / "face.npz"
    out.write_bytes(b"mine")
    one_line(*avatar_train("asm", "scan", *given(files), "-o", out)[::2], "face.npz", "exists; pass --force")
    assert out.read_bytes() == b"mine"
    one_line(
        *avatar_train("asm", "scan", *given(files), "-o", files / "face.obj")[::2], "does not end in .npz"
    )
    one_line(*avatar_train("asm", "scan", *given(files), "-o", out / "in" / "a.npz")[::2], "is a file")
    assert avatar_train("asm", "scan", *given(files), "-o", out, "--force")[0] == 0
    assert load(out).name == "scan"


def keypoints(files: Path, change: Callable[[dict[str, object]], object]) -> Path:
    found = json.loads((files / "keypoints.json").read_text())
    changed = change(found)
    path = files / "wrong.json"
    path.write_text(json.dumps(found if changed is None else changed))
    return path


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.pop("nose_bottom") and None, "nose_bottom: is missing"),
        (lambda d: d.update(nose_botom=[0, 0, 0]), "'nose_botom' is not a keypoint; did you mean nose_bottom"),
        (lambda d: d.update(nose_bottom=[0, 1, 1e99]), "nose_bottom: is not three finite numbers"),
        (lambda d: [d], "is not an object"),
    ],
)  # fmt: skip
def test_keypoints_that_are_unsound_are_one_line(
    avatar_train: Command, files: Path, change: Callable[[dict[str, object]], object], said: str
) -> None:
    arguments = [keypoints(files, change) if a == files / "keypoints.json" else a for a in given(files)]
    one_line(*avatar_train("asm", "scan", *arguments, "-o", files / "face.npz")[::2], "wrong.json", said)


def no_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise AssertionError("fitted before everything was looked at")

    monkeypatch.setattr(asm, "register_takes", fail)


@pytest.mark.parametrize(
    ("scans", "said"),
    [
        (("scan.obj", "smile.ply", "in/smile.ply"), "in/smile.ply: take_names: 'smile' is empty"),
        (("scan.obj", "neutral.ply"), "neutral.ply: take_names: 'neutral' is empty, unprintable or a duplicate"),
        (("scan.obj", "smile.ply", "a\tb.ply"), "take_names: 'a\\tb' is empty, unprintable or a duplicate"),
        (("a\tb.obj",), "name: 'a\\tb' is empty or unprintable"),
    ],
)  # fmt: skip
def test_names_are_looked_at_before_the_fit(
    avatar_train: Command, files: Path, monkeypatch: pytest.MonkeyPatch, scans: tuple[str, ...], said: str
) -> None:
    no_fit(monkeypatch)
    for name in scans:
        (files / name).parent.mkdir(exist_ok=True)
        (files / name).write_bytes(
            (files / ("scan.obj" if name.endswith("obj") else "smile.ply")).read_bytes()
        )
    others = [part for name in scans[1:] for part in ("--expression", files / name)]
    one_line(*avatar_train("asm", "scan", *given(files, scans[0]), *others, "-o", files / "f.npz")[::2], said)


def test_units_and_keypoints_that_cannot_be_are_one_line(
    avatar_train: Command, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    no_fit(monkeypatch)

    def said(units: float, place: str, *parts: str) -> None:
        arguments = [units if a == 1000 else a for a in given(files)]
        arguments = [files / place if a == files / "keypoints.json" else a for a in arguments]
        one_line(*avatar_train("asm", "scan", *arguments, "-o", files / "f.npz")[::2], place, *parts)

    said(1, "keypoints.json", "eyes are 96.1 m apart; 0.04 to 0.25 make sense: is --units right?")
    said(1e5, "keypoints.json", "eyes are 0.000961 m apart")
    far = keypoints(files, lambda d: {name: [7000 * x for x in at] for name, at in d.items()})  # type: ignore[attr-defined]
    for units in (0, 1000):
        said(units, far.name, "keypoint right_eye_outer: lies far from the scan")
    one = keypoints(files, lambda d: d.update(mouth_left=[0, 0, 400]))
    said(0, one.name, "keypoint mouth_left: lies far from the scan; are the keypoints in its unit?")
