"""The own layout: what is written comes back, and what is wrong is said before training, by file and row."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.joints import rest_transforms
from avatar_schema import schema
from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.own import Shot, write
from tests.oracles.lbs import rodrigues
from tests.trainer.captures import folders
from tests.trainer.captures.folders import HEIGHT, WIDTH, K


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


def test_joints_and_world_are_what_they_say(tmp_path: Path) -> None:
    capture = load(folders.own(tmp_path / "take"))
    jaw, neck = (capture.rig.joint_names.index(name) for name in ("jaw", "neck"))
    for t, frame in enumerate(capture.frames):
        shot, delta = folders.shot(t), frame.pose.joint_delta
        assert np.abs(delta[jaw, :3, :3] - rodrigues(np.asarray(shot.joints["jaw"]))).max() < 1e-8
        assert np.abs(delta[neck] - shot.joints["neck"]).max() < 1e-8
        rest = [j for j in range(capture.rig.joint_count) if j not in (jaw, neck)]
        assert (delta[rest] == np.eye(4)).all()
        assert np.array_equal(frame.pose.world_from_avatar, shot.world_from_avatar)


def test_camera_is_that_of_k(tmp_path: Path) -> None:
    """A world point falls on the pixel that K gives it, with pixel centres at half integers."""
    frame = load(folders.own(tmp_path / "take")).frames[3]
    shot = folders.shot(3)
    point = np.array([0.02, -0.03, 0.05])
    at = K @ (shot.rotation @ point + shot.translation)
    clip = frame.camera.clip_from_world @ np.append(point, 1)
    across, down = clip[:2] / clip[3]
    assert abs((across + 1) / 2 * WIDTH - at[0] / at[2]) < 1e-4
    assert abs((down + 1) / 2 * HEIGHT - at[1] / at[2]) < 1e-4


def test_identity_eyelids_and_anchors_are_of_the_body(tmp_path: Path) -> None:
    rig = load(folders.own(tmp_path / "take")).rig
    model = folders.body_folder(tmp_path / "again")
    want = model["v_template"] + model["identity"] @ model["shape"]
    assert np.abs(rig.vertices - want).max() < 1e-6
    assert rig.anchor_vertices.tolist() == model["triangles"][[3, 4, 5, 3]].ravel().tolist()
    assert rig.late_morphs.columns == 2 and rest_transforms(rig).shape == (5, 4, 4)


def test_body_files_given_stand_in_place_of_the_captures(tmp_path: Path) -> None:
    take = folders.own(tmp_path / "take")
    folders.body_folder(tmp_path / "other")
    (take / "body" / "body_model.npz").unlink()
    with pytest.raises(AvatarError, match=r"body_model\.npz: cannot be read"):
        load(take)
    capture = load(take, body_model=tmp_path / "other" / "body_model.npz")
    assert capture.export_inputs["body_model"] == tmp_path / "other" / "body_model.npz"


def test_without_shape_the_exporter_is_told_zero(tmp_path: Path) -> None:
    take = folders.changed(folders.own(tmp_path / "take"), lambda d: d["body"].pop("shape"))
    capture = load(take)
    assert capture.export_inputs["shape"] == Path("zero")
    assert np.array_equal(capture.rig.vertices, folders.body_folder(tmp_path / "again")["v_template"])


def test_what_is_written_is_of_the_schema(tmp_path: Path) -> None:
    found = schema("capture")
    Draft202012Validator.check_schema(found)
    document = json.loads((folders.own(tmp_path / "take") / "capture.json").read_text())
    assert not list(Draft202012Validator(found).iter_errors(document))


def test_write_refuses_what_is_no_capture(tmp_path: Path) -> None:
    def made(*shots: Shot) -> None:
        named = ((str(i), shot) for i, shot in enumerate(shots))
        write(tmp_path, name="x", fps=1, head_pose_in="mesh", expressions=(), body={}, frames=named)

    with pytest.raises(ValueError, match="without frames"):
        made()
    with pytest.raises(ValueError, match="shot 1"):
        made(folders.shot(0), folders.shot(1, mask=np.zeros((HEIGHT, WIDTH + 1), np.uint8)))
    assert not (tmp_path / "capture.json").exists()


def test_default_split_is_the_last_fifth_and_at_most_350(tmp_path: Path) -> None:
    """As many as the papers hold out, of long takes."""
    from avatar_trainer.captures.rows import Row, splits

    def held_out(count: int) -> list[int]:
        nothing: Any = None
        row = Row(tmp_path, "", tmp_path, tmp_path, nothing, nothing, nothing, nothing, None)
        return [i for i, split in enumerate(splits([row] * count)) if split == "test"]

    assert held_out(4) == []
    assert held_out(10) == [8, 9]
    assert held_out(1750) == list(range(1400, 1750))
    assert held_out(5000) == list(range(4650, 5000))


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
    (top("version", 1), "version"),
    (top("width", 99999), "width: 99999 is greater than the maximum"),
    (top("width", WIDTH + 1), rf"000\.png: is {WIDTH}x{HEIGHT} pixels, the capture says {WIDTH + 1}x{HEIGHT}"),
    (top("head_pose_in", "neck"), "head_pose_in: 'neck' is unknown"),
    (top("expressions", ["exp_002", "smile"]), "expressions: 'smile' is not an expression of the body"),
    (top("expressions", ["exp_002"]), r"frames\[0\].expression: has 2 values, the capture names 1"),
    (top("eyelids", ["left", "middle"]), "eyelids: 'middle' is not an eyelid of the body"),
    (top("frames", []), "frames"),
    (lambda d: d["frames"].pop(1) and d.update(frames=d["frames"][:1]), "frames"),
    (lambda d: d["body"].update(model="../body_model.npz"), "body.model: '../body_model.npz' leaves the capture's"),
    (lambda d: d["body"].update(kind="ghost"), "body: .* is not {kind: body_model, model} or"),
    (frame(2, "image")("/etc/passwd"), r"frames\[2\].image: '/etc/passwd' leaves the capture's folder"),
    (frame(2, "image")("a\\b.png"), r"frames\[2\].image: .* leaves"),
    (frame(2, "image")("C:/b.png"), r"frames\[2\].image: .* leaves"),
    (frame(2, "mask")("masks/../../x.png"), r"frames\[2\].mask: .* leaves"),
    (frame(2, "image")("images/a\0b.png"), r"frames\[2\].image: .* is not a valid path"),
    (frame(2, "image")("\ud800.png"), r"frames\[2\].image: .* is not a valid path"),
    (frame(2, "image")("頭" * 90), r"frames\[2\].image: .* is not a valid path"),
    (frame(2, "image")("images/zzz.png"), r"zzz\.png: no such image"),
    (frame(2, "mask")("masks/zzz.png"), r"zzz\.png: no such image"),
    (lambda d: d["frames"][2].pop("mask"), r"frames\[2\]: 'mask' is a required"),
    (frame(2, "mask")("images/002.png"), r"002\.png: has no alpha channel and no mask"),
    (frame(2, "image")("images/001.png"), r"frames\[2\].image: is called '001' as frames\[1\] is"),
    (frame(1, "camera", "K", 0, 0)(0), r"frames\[1\].camera.K: is singular or mirrored: focal length fx is 0"),
    (frame(1, "camera", "K", 1, 1)(-3), r"frames\[1\].camera.K: .* fy is -3"),
    (frame(1, "camera", "K", 2, 2)(2), r"frames\[1\].camera.K: is not \[\[fx"),
    (frame(1, "camera", "K", 0, 2)(float("nan")), r"frames\[1\].camera.K: \[0, 2\] is not a usable"),
    (frame(1, "camera", "K")([[1, 0], [0, 1]]), r"frames\[1\].camera.K"),
    (frame(1, "camera", "R")(HALF), r"frames\[1\].camera.R: is not a rotation: an entry of R R\^T - I is 0.75"),
    (frame(1, "camera", "R")(np.diag([1, 1, -1]).tolist()), r"frames\[1\].camera.R: .* it mirrors"),
    (frame(1, "camera", "t", 1)(float("inf")), r"frames\[1\].camera.t"),
    (frame(4, "expression", 0)(float("nan")), r"frames\[4\].expression: \[2\] \(exp_002\) is not a usable number"),
    (frame(4, "expression", 0)(True), r"frames\[4\].expression\[0\]"),
    (frame(4, "expression", 0)(10**400), r"frames\[4\].expression\[0\]"),
    (frame(4, "expression")([0.0] * 3), r"frames\[4\].expression: has 3 values, the capture names 2"),
    (frame(4, "eyelids")([0.0]), r"frames\[4\].eyelids: has 1 values, the capture names 2"),
    (frame(4, "eyelids", 1)(float("nan")), r"frames\[4\].eyelids: \[0\] is not a usable number"),
    (frame(4, "joints")({"jaws": [0, 0, 0]}), r"frames\[4\].joints: 'jaws' is not a joint of the body; did you"),
    (frame(4, "joints")({"jaw": [0, 0]}), r"frames\[4\].joints.jaw: \[0, 0\] is not 3 numbers"),
    (frame(4, "joints")({"jaw": [0, float("nan"), 0]}), r"frames\[4\].joints: jaw is .*: not usable numbers"),
    (frame(4, "joints")({"jaw": [*np.eye(4).ravel()[:-1], 2.0]}), r"frames\[4\].joints: jaw has a last row"),
    (frame(4, "world_from_avatar")([2.0, *np.eye(4).ravel()[1:]]), r"frames\[4\].world_from_avatar: is not a rotation"),
    (frame(4, "world_from_avatar")([1.0] * 16), r"frames\[4\].world_from_avatar: has a last row"),
    (frame(4, "split")("test"), r"frames\[4\].split: is given here but not in every frame"),
    (frame(4, "split")("validation"), r"frames\[4\].split: 'validation' is unknown"),
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


def test_all_frames_to_train_on_is_allowed(tmp_path: Path) -> None:
    take = folders.changed(folders.own(tmp_path / "take"), split_all(*["train"] * folders.FRAMES))
    capture = load(take)
    assert len(capture.train) == folders.FRAMES and not capture.test
