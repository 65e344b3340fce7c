"""Options, settings and rules of avatar-train: what is wrong is one line, before anything is written."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from avatar_export.making import options as of_make
from avatar_trainer.systems.table import SYSTEMS

Train = Callable[..., tuple[int, str, str]]


def test_what_is_missing_is_told_before_preparing(
    folder: Path, tmp_path: Path, avatar_train: Train, monkeypatch: pytest.MonkeyPatch
) -> None:
    find, export = importlib.util.find_spec, ("--export", tmp_path / "bundle")
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name in ("gsplat", "lpips") else find(name)
    )
    for (system, *options), said in [
        (("toy", "--rasteriser", "gsplat"), "rasteriser gsplat: needs gsplat"),
        (("splatting_avatar", "--set", "lpips=1"), "lpips: needs the package lpips"),
        (("gaussian_blendshapes", "--set", "weights.lpips=1"), "weights.lpips: needs the package lpips"),
        (("splatting_avatar", "--rule", "embedding=fixed", *export), "embedding=fixed is for comparison"),
        (("psavatar", "--rule", "order=as_printed", *export), "order=as_printed is for comparison"),
    ]:
        code, _, err = avatar_train(system, tmp_path / "no capture", "-o", tmp_path / "out", *options)
        assert code == 2 and said in err and err.count("\n") == 1, err


OUT_OF_RANGE = {
    "toy": (
        ("--seed", "4294967296", "seed is 4294967296; at least 0, at most 2147483647"),
        ("--size", "99999999999", "size is 99999999999"),
        ("--iterations", "99999999999", "iterations is 99999999999"),
        ("--set", "density.densify_every=0", "densify_every is 0; at least 1"),
        ("--set", "density.percent_dense=-1", "percent_dense is -1.0; at least 0"),
    ),
    "splatting_avatar": (
        ("--gaussians", "1000001", "gaussians is 1000001; at least 1, at most 1000000"),
        ("--set", "learning_rates.position=0", "settings.learning_rates: position is 0.0"),
        ("--set", "walk_decay=2", "walk_decay is 2.0"),
    ),
    "psavatar": (
        ("--set", "off_mesh=1.1", "off_mesh is 1.1; at least 0, at most 1"),
        ("--set", "region=nose", "region is 'nose'; one of all, head, face"),
        ("--set", "vgg=0.1", "vgg needs vgg_weights"),
        ("--set", "scale=1e7", "scale is 1"),
    ),
    "gaussian_blendshapes": (
        ("--gaussians", "250001", "gaussians is 250001; at least 4, at most 250000"),
        ("--set", "weights.dssim=2", "dssim is 2.0; at least 0, at most 1"),
        ("--set", "mouth_cylinder=0,0,0,1e-9,0", "mouth_cylinder has radius 1e-09"),
        ("--set", "mouth_cylinder=0,0,0,0.05,0", "half height 0.0; at least 0.001"),
        ("--set", "delta_sh_degree=3", "delta_sh_degree"),
        ("--set", "background=pink", "background"),
        ("--set", "unseen=0", "unseen is 0.0; above 0, at most 1"),
    ),
}


@pytest.mark.parametrize(
    ("system", "option", "value", "said"),
    [(system, *case) for system, cases in OUT_OF_RANGE.items() for case in cases],
)
def test_numbers_out_of_range_are_one_line(
    system: str, option: str, value: str, said: str, tmp_path: Path, avatar_train: Train
) -> None:
    code, _, err = avatar_train(system, tmp_path / "no capture", "-o", tmp_path / "out", option, value)
    assert code == 2 and said in err and err.count("\n") == 1, err


WRONG = [
    (["--set", "density.densify_ever=3"], "did you mean density.densify_every"),
    (["--set", "density.densify_every=few"], "expected a whole number"),
    (["--set", "learning_rate=nan"], "expected a finite number"),
    (["--set", "learning_rate=-1"], "learning_rate must be above 0"),
    (["--set", "iterations=3"], "'iterations' is not a setting"),
    (["--set", "seed"], "avatar-train: --set: 'seed' is not NAME=VALUE"),
    (["--set", "log_every=2", "--set", "log_every=3"], "log_every is given 2 times"),
    (["--rule", "sky=black", "--rule", "sky=black"], "sky is given 2 times"),
    (["--rule", "skye=black"], "did you mean sky?"),
    (["--rasteriser", "gpu"], "'gpu' is not one of cpu"),
    (["--sh-degree", "4"], "--sh-degree"),
]


@pytest.mark.parametrize(("options", "said"), WRONG, ids=[" ".join(options) for options, _ in WRONG])
def test_a_wrong_option_ends_before_anything_is_written(
    options: list[str], said: str, folder: Path, tmp_path: Path, avatar_train: Train
) -> None:
    code, _, err = avatar_train("toy", folder, "-o", tmp_path / "out", *options)
    flat = " ".join(err.replace("│", " ").split())
    assert code == 2 and said in flat and "Traceback" not in err
    assert not (tmp_path / "out").exists()


def test_rules_and_settings_are_listed(avatar_train: Train) -> None:
    code, said, _ = avatar_train("rules", "--json")
    listed = json.loads(said)
    assert code == 0 and set(listed) == set(SYSTEMS)
    assert listed["toy"]["sky"] == {
        "values": ["random", "black"], "released": "random", "paper": "black", "default": "random",
        "about": "what is behind the cloud", "trainer_only": [],
    }  # fmt: skip
    assert "sky = random | black" in avatar_train("rules")[1]
    code, said, _ = avatar_train("settings", "toy", "--json")
    assert code == 0 and json.loads(said)["density.max_gaussians"] == 80
    assert "density.max_gaussians" in avatar_train("settings", "toy")[1]
    assert avatar_train("settings", "toi")[0] == 2


def test_make_knows_the_systems_of_the_trainer() -> None:
    assert {*of_make.SYSTEMS} == SYSTEMS.keys() - {"toy"}
