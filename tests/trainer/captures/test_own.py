"""The own layout: what is written comes back, and what is wrong is said before training, by file and row."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.own import Shot, write
from tests.trainer.captures import folders
from tests.trainer.captures.folders import HEIGHT, WIDTH


def test_what_was_written_comes_back(tmp_path: Path) -> None:
    capture = load(folders.own(tmp_path / "take"))
    assert (capture.name, capture.width, capture.height, capture.fps) == ("small", WIDTH, HEIGHT, 30)
    assert (capture.head_pose_in, capture.rights) == ("camera", folders.RIGHTS)
    assert capture.expression_names == ("exp_000", "exp_001", "exp_002")
    assert capture.eyelids == ("left", "right")
    body = tmp_path / "take" / "body"
    assert capture.export_inputs == {
        "body_model": body / "body_model.npz",
        "shape": body / "shape.npy",
        "eyelids": body,
        "anchor_faces": body / "back_of_head.txt",
    }
    assert capture.poses == "estimated"
    assert [frame.name for frame in capture.frames] == [f"{t:03d}" for t in range(folders.FRAMES)]
    for t, frame in enumerate(capture.frames):
        shot, view = folders.shot(t), frame.camera.camera_from_world
        first, second = shot.expression
        assert frame.pose.expression_weights.tolist() == [second, 0, first], "columns by name"
        assert frame.pose.late_weights.tolist() == list(shot.eyelids)[::-1]
        assert np.abs(view[:3, :3] - shot.rotation).max() < 1e-7
        assert np.abs(view[:3, 3] - shot.translation).max() < 1e-7
        image, mask = pixels(frame)
        assert image.dtype == mask.dtype == np.float32
        assert np.abs(image * 255 - shot.image).max() < 1e-4
        assert np.abs(mask * 255 - shot.mask).max() < 1e-4


def frame(i: int, *path: str | int) -> Callable[[Any], Callable[[dict[str, Any]], object]]:
    """A change of capture.json: what stands at `path` of frame i becomes the value."""

    def put(value: Any) -> Callable[[dict[str, Any]], object]:
        def change(document: dict[str, Any]) -> None:
            at: Any = document["frames"][i]
            for key in path[:-1]:
                at = at[key]
            at[path[-1]] = value

        return change

    return put


def top(key: str, value: Any) -> Callable[[dict[str, Any]], object]:
    return lambda document: document.update({key: value})


def split_all(*said: str) -> Callable[[dict[str, Any]], object]:
    def change(document: dict[str, Any]) -> None:
        for entry, split in zip(document["frames"], said, strict=False):
            entry["split"] = split

    return change


HALF = np.diag([0.5, 1, 1]).tolist()
BAD = [
    (top("version", "2.0"), "capture.json: version: is 2.0; 1.0 is known: update"),
    (top("width", 99999), "width: 99999 is greater than the maximum"),
    (top("width", WIDTH + 1), rf"000\.png: is {WIDTH}x{HEIGHT} pixels, the capture says {WIDTH + 1}x{HEIGHT}"),
    (top("poses", "guessed"), "poses: 'guessed' is unknown"),
    (top("head_pose_in", "neck"), "head_pose_in: 'neck' is unknown"),
    (top("expressions", ["exp_002", "smile"]), "expressions: 'smile' is not an expression of the body"),
    (top("expressions", ["exp_002"]), r"frames\[0\].expression: has 2 values, the capture names 1"),
    (top("eyelids", ["left", "middle"]), "eyelids: 'middle' is not an eyelid of the body"),
    (lambda d: d["frames"].pop(1) and d.update(frames=d["frames"][:1]), "frames"),
    (lambda d: d["body"].update(model="../body_model.npz"), "body.model: '../body_model.npz' leaves the capture's"),
    (lambda d: d["body"].update(kind="ghost"), "body: .* is not {kind: body_model, model} or"),
    (frame(2, "image")("/etc/passwd"), r"frames\[2\].image: '/etc/passwd' leaves the capture's folder"),
    (frame(2, "image")("C:/b.png"), r"frames\[2\].image: .* leaves"),
    (frame(2, "mask")("masks/../../x.png"), r"frames\[2\].mask: .* leaves"),
    (frame(2, "image")("images/a\0b.png"), r"frames\[2\].image: .* is not a valid path"),
    (frame(2, "image")("images/zzz.png"), r"zzz\.png: no such image"),
    (lambda d: d["frames"][2].pop("mask"), r"frames\[2\]: 'mask' is a required"),
    (frame(2, "mask")("images/002.png"), r"002\.png: has no alpha channel and no mask"),
    (frame(1, "camera", "K", 0, 0)(0), r"frames\[1\].camera.K: is singular or mirrored: focal length fx is 0"),
    (frame(1, "camera", "K", 0, 2)(float("nan")), r"frames\[1\].camera.K: \[0, 2\] is not a usable"),
    (frame(1, "camera", "R")(HALF), r"frames\[1\].camera.R: is not a rotation: an entry of R R\^T - I is 0.75"),
    (frame(1, "camera", "R")(np.diag([1, 1, -1]).tolist()), r"frames\[1\].camera.R: .* it mirrors"),
    (frame(4, "expression", 0)(float("nan")), r"frames\[4\].expression: \[2\] \(exp_002\) is not a usable number"),
    (frame(4, "expression")([0.0] * 3), r"frames\[4\].expression: has 3 values, the capture names 2"),
    (frame(4, "eyelids")([0.0]), r"frames\[4\].eyelids: has 1 values, the capture names 2"),
    (frame(4, "joints")({"jaws": [0, 0, 0]}), r"frames\[4\].joints: 'jaws' is not a joint of the body; did you"),
    (frame(4, "joints")({"jaw": [0, float("nan"), 0]}), r"frames\[4\].joints: jaw is .*: not usable numbers"),
    (frame(4, "joints")({"jaw": [*np.eye(4).ravel()[:-1], 2.0]}), r"frames\[4\].joints: jaw has a last row"),
    (frame(4, "world_from_avatar")([2.0, *np.eye(4).ravel()[1:]]), r"frames\[4\].world_from_avatar: is not a rotation"),
    (frame(4, "split")("test"), r"frames\[4\].split: is given here but not in every frame"),
    (split_all("train", *["test"] * 5), r"capture\.json: leaves 1 to train on"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BAD)
def test_bad_input_is_named(tmp_path: Path, change: Callable[[dict[str, Any]], object], message: str) -> None:
    take = folders.changed(folders.own(tmp_path / "take"), change)
    with pytest.raises(AvatarError, match=message) as caught:
        load(take)
    assert "\n" not in str(caught.value)
    assert caught.value.file and Path(caught.value.file).is_relative_to(take)


def test_json_that_is_none_or_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    take = folders.own(tmp_path / "take")
    monkeypatch.setattr("avatar_trainer.captures.own.MAX_JSON_BYTES", 100)
    with pytest.raises(AvatarError, match="bytes long; up to 100 are read"):
        load(take)
    monkeypatch.undo()
    for text in ("{", "[" * 100_000, "[]", "\xff"):
        (take / "capture.json").write_text(text, "latin1")
        with pytest.raises(AvatarError, match=r"capture\.json"):
            load(take)


def test_write_refuses_what_is_no_capture(tmp_path: Path) -> None:
    def made(*shots: Shot) -> None:
        named = ((str(i), shot) for i, shot in enumerate(shots))
        write(tmp_path, name="x", fps=1, head_pose_in="mesh", expressions=(), body={}, frames=named)

    with pytest.raises(ValueError, match="without frames"):
        made()
    with pytest.raises(ValueError, match="shot 1"):
        made(folders.shot(0), folders.shot(1, mask=np.zeros((HEIGHT, WIDTH + 1), np.uint8)))
    assert not (tmp_path / "capture.json").exists()
