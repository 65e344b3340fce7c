"""What Gaussian Blendshapes saves: the released layout, and through the exporter the same splats again."""

from __future__ import annotations

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
from avatar_trainer.systems.gaussian_blendshapes import files
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


def test_layout_is_that_of_the_released_code(tmp_path: Path, blendshapes_golden: BlendshapesGolden) -> None:
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
