"""What Gaussian Blendshapes saves: the released layout, and through the exporter the same splats again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.reference import make
from avatar_runtime.posed import Clock, Poser
from avatar_runtime.stages.project import project
from avatar_runtime.stages.raster import raster
from avatar_runtime.stages.sort import sort
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.gaussian_blendshapes import files
from avatar_trainer.systems.gaussian_blendshapes.npy import write_npy_dict
from avatar_trainer.systems.gaussian_blendshapes.system import GaussianBlendshapes
from tests.golden import BlendshapesGolden
from tests.measured import Measure
from tests.trainer.systems.gaussian_blendshapes.subjects import subject

ITERATION = 12
CASES: dict[str, tuple[dict[str, str], dict[str, Any]]] = {
    "released": ({}, {}),
    "paper": ({"mask": "per_blendshape", "init_position": "rotation", "init_sh": "rotated"}, {}),
    "anchor and jaw": ({"anchor": "unique", "lower_teeth": "jaw"}, {}),
    "no consistency": ({"consistency": "none"}, {}),
    "consistency of positions": ({"consistency": "position"}, {}),
    "fixed differences": ({"deltas": "fixed"}, {}),
    "no mouth": ({"mouth": "off"}, {}),
    "degree 0, white": ({}, {"sh_degree": 0, "delta_sh_degree": 0, "background": "white"}),
    "differences of degree 0": ({}, {"delta_sh_degree": 0, "least_mask": 0.0}),
}


def exported(system: GaussianBlendshapes, folder: Path) -> Avatar:
    """What the exporter reads of the files."""
    system.save(folder, ITERATION)
    return read(folder, ReadOptions(**system.capture.export_inputs))


@pytest.mark.parametrize("case", CASES)
def test_the_files_play_what_was_trained(case: str, tmp_path: Path, measured: Measure) -> None:
    rules, changed = CASES[case]
    system = subject(tmp_path, rules, **changed)
    avatar = exported(system, tmp_path / "model")
    assert avatar.sh_degree == system.sh_degree
    assert avatar.raster.background == ((1.0,) * 3 if "white" in case else (0.0,) * 3)
    for frame in system.capture.frames:
        played = make(avatar).animate(Poser(avatar).posed(frame.pose), Clock())
        splats = system.splats(frame.pose)
        coefficients = splats.sh.shape[1]
        assert played.sh_rotation is not None and splats.sh_rotation is not None
        turned = np.abs(played.sh_rotation - splats.sh_rotation.numpy()).max()
        sign = np.sign(np.sum(played.quat_wxyz * splats.quat_wxyz.detach().numpy(), axis=1, keepdims=True))
        worst = {
            "mean, m": np.abs(played.mean - splats.mean.detach().numpy()).max(),
            "scale, relative": np.abs(played.scale / splats.scale.detach().numpy() - 1).max(),
            "quaternion": np.abs(played.quat_wxyz * sign - splats.quat_wxyz.detach().numpy()).max(),
            "opacity": np.abs(played.opacity - splats.opacity.detach().numpy()).max(),
            "sh": np.abs(played.sh[:, :coefficients] - splats.sh.detach().numpy()).max(),
            "sh frame": turned,
        }
        assert (played.sh[:, coefficients:] == 0).all()
        for name, value in worst.items():
            measured(f"gaussian_blendshapes files, {name}", float(value))
            assert value < 1e-5, (case, name)


def test_the_files_draw_what_was_trained(tmp_path: Path, measured: Measure) -> None:
    system = subject(tmp_path)
    avatar = exported(system, tmp_path / "model")
    for frame in system.capture.frames:
        splats = make(avatar).animate(Poser(avatar).posed(frame.pose), Clock())
        seen = project(splats, frame.camera, avatar.raster, avatar.sh_degree)
        played = raster(seen, sort(seen), frame.camera, np.zeros(3, np.float32), "trainer")
        trained = draw(system, frame)
        worst = np.abs(played.colour - trained.colour.numpy()).max()
        measured("gaussian_blendshapes files, image", float(worst))
        assert worst < 1e-4 and float(trained.alpha.max()) > 0.1


def test_layout_is_that_of_the_released_code(tmp_path: Path, blendshapes_golden: BlendshapesGolden) -> None:
    """Types and shapes as in a checkpoint that the released code wrote, except for numbers of rows, expressions."""
    system = subject(tmp_path)
    system.save(tmp_path / "model", ITERATION)

    def described(value: Any, rows: dict[int, str]) -> Any:
        if isinstance(value, (torch.Tensor, np.ndarray)):
            return type(value), str(value.dtype), [rows.get(n, n) for n in value.shape]
        return type(value)

    own_rows, theirs = {60: "P", 7: "M", 3: 3}, {1503: "P", 1210: "P", 100: "M"}
    for name in ("fix_chkpnt", "mouth0_chkpnt", "mouth1_chkpnt"):
        own, iteration = torch.load(tmp_path / "model" / f"{name}{ITERATION}.pth", weights_only=True)
        other, _ = torch.load(
            blendshapes_golden.raw / f"{name}40000.pth", weights_only=True, map_location="cpu"
        )
        assert iteration == ITERATION and isinstance(own, tuple) and len(own) == len(other)
        for item, (a, b) in enumerate(zip(own, other, strict=True)):
            mine, known = described(a, own_rows), described(b, theirs)
            if 10 <= item <= 14 and name == "fix_chkpnt":
                assert known[2].pop() == 50 and mine[2].pop() == system.expressions
            assert mine == known, (name, item)
        assert [g["name"] for g in own[-2]["param_groups"]] == [g["name"] for g in other[-2]["param_groups"]]
    acc = np.load(tmp_path / "model" / f"acc{ITERATION}.npy", allow_pickle=True).item()
    released = np.load(blendshapes_golden.raw / "acc40000.npy", allow_pickle=True).item()
    assert list(acc) == list(released)
    for key in acc:
        mine, known = described(acc[key], own_rows), described(released[key], theirs)
        expected = [3 if n == 50 else n for n in known[2]]
        assert mine == (known[0], known[1], expected), key
    assert "Namespace(sh_degree=3" in (tmp_path / "model" / "cfg_args").read_text()


def test_dense_values_are_the_entries(tmp_path: Path) -> None:
    system = subject(tmp_path)
    system.save(tmp_path, ITERATION)
    face, _ = torch.load(tmp_path / f"fix_chkpnt{ITERATION}.pth", weights_only=True)
    acc = np.load(tmp_path / f"acc{ITERATION}.npy", allow_pickle=True).item()
    rows, there = system.rows, np.zeros((60, 3), bool)
    for row in range(60):
        for entry in range(*rows.learned.row_ptr[row : row + 2].tolist()):
            column = int(rows.learned.column[entry])
            there[row, column] = True
            assert torch.equal(face[11][row, :4, :, column], system.table["delta_sh"][entry])
            assert torch.equal(face[13][row, :, column], system.table["delta_quat_wxyz"][entry])
            assert acc["expr_mask_tensor"][row, column] == rows.mask[entry]
    assert there.any() and (face[11].detach().numpy()[:, 4:] == 0).all()
    assert (face[10].detach().numpy().transpose(0, 2, 1)[~there] == 0).all()
    assert (acc["expr_mask_tensor"][~there] == 0).all()


def test_rules_that_a_reader_knows_are_written(tmp_path: Path) -> None:
    system = subject(tmp_path, {"anchor": "unique", "mask": "per_blendshape"})
    avatar = exported(system, tmp_path / "model")
    written = json.loads((tmp_path / "model" / "rules.json").read_text())
    assert (written["system"], written["training_units_per_metre"]) == ("gaussian_blendshapes", 1.0)
    assert written["rules"]["anchor"] == "unique" == avatar.rules.anchor
    assert written["rules"]["mask"] == "per_blendshape"


def test_a_file_is_there_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = subject(tmp_path)
    model = tmp_path / "model"
    system.save(model, 1)
    before = {path.name for path in model.iterdir()}

    def cut_short(obj: Any, path: Path) -> None:
        path.write_bytes(b"PK half a file")
        if path.name.startswith(".fix"):
            raise OSError("no space left on device")

    monkeypatch.setattr(files.torch, "save", cut_short)
    with pytest.raises(OSError, match="no space"):
        system.save(model, 2)
    left = {path.name for path in model.iterdir()} - before
    assert left == {"mouth0_chkpnt2.pth", "mouth1_chkpnt2.pth", "acc2.npy"}
    monkeypatch.undo()
    assert read(model, ReadOptions(**system.capture.export_inputs)).gaussians.count == 74


def test_npy_dict_refuses_what_it_cannot_write(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="float64"):
        write_npy_dict(tmp_path / "a.npy", {"x": np.zeros(3)})
    arrays = {"x": np.arange(6, dtype=np.float32).reshape(2, 3).T, "y": np.zeros((0, 4), np.float32)}
    write_npy_dict(tmp_path / "a.npy", arrays)
    back = np.load(tmp_path / "a.npy", allow_pickle=True).item()
    assert list(back) == ["x", "y"] and back["y"].shape == (0, 4)
    assert np.array_equal(back["x"], arrays["x"]) and back["x"].dtype == np.float32
