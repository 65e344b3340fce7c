"""rules.json beside a checkpoint: entries that change the avatar, entries that only describe, refused entries."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from avatar_export.readers.rules_file import MAX_BYTES, RULES_FILE
from avatar_export.readers.table import read
from avatar_runtime.avatar import Rules
from tests.exporter.readers.splatting_files import read_run
from tests.exporter.readers.test_gaussian_blendshapes import options
from tests.exporter.refusals import refused
from tests.golden import BlendshapesGolden

CODE = Rules("vertex_quaternion", None, "inverse_rotation", scale="log_area")
PAPER = {"scale": "linear_area", "position": "interpolated_normal", "rotation": "vertex_quaternion_mean"}


def write_rules(folder: Path, system: str, **rules: Any) -> Path:
    path = folder / RULES_FILE
    path.write_text(json.dumps({"system": system, "rules": rules}))
    return path


@pytest.fixture
def model(blendshapes_golden: BlendshapesGolden, tmp_path: Path) -> Path:
    """A copy of the released code's dump."""
    return Path(shutil.copytree(blendshapes_golden.viewer, tmp_path / "model"))


@pytest.mark.parametrize(
    ("rules", "given", "want", "said"),
    [
        ({}, {}, {}, "config.yaml model.with_mesh_scaling"),
        (PAPER, {}, PAPER, "rules.json"),
        *((rule, {}, rule, "rules.json") for rule in (
            {"position": "interpolated_normal"}, {"rotation": "vertex_quaternion_mean"}, {"scale": "none"},
            {"sh_direction": "world"}, {"rotation": "vertex_quaternion", "position": "normal"})),
        (PAPER, {"mesh_scaling": True}, PAPER | {"scale": "log_area"}, "--mesh-scaling"),
        (PAPER, {"mesh_scaling": False}, PAPER | {"scale": "none"}, "--mesh-scaling"),
        ({"sh_direction": "world"}, {"sh_direction": "inverse_rotation"}, {}, "--sh-direction"),
    ],
)  # fmt: skip
def test_splatting_avatar_is_played_by_them(
    rules: dict[str, str], given: dict[str, Any], want: dict[str, str], said: str, run: Path
) -> None:
    write_rules(run, "splatting_avatar", **rules)
    avatar = read_run(run, **given)
    assert avatar.rules == replace(CODE, **want)
    assert said in avatar.provenance["notes"][0]
    assert RULES_FILE in [file["path"] for file in avatar.provenance["source_files"]]


def test_it_lies_beside_config_yaml_or_beside_the_ply(run: Path) -> None:
    path = write_rules(run, "splatting_avatar", **PAPER)
    write_rules(run.parent, "splatting_avatar", position="normal")
    assert read_run(run / "point_cloud" / "iteration_30000").rules.position == "interpolated_normal"
    path.rename(run / "point_cloud" / "iteration_30000" / RULES_FILE)
    assert read_run(run).rules.position == "interpolated_normal"


@pytest.mark.parametrize(("lower_teeth", "joints"), [("mix", {"root", "neck", "jaw"}), ("jaw", {"jaw"})])
@pytest.mark.parametrize("anchor", ["repeats", "unique"])
def test_gaussian_blendshapes_is_played_by_them(
    anchor: str, lower_teeth: str, joints: set[str], model: Path, blendshapes_golden: BlendshapesGolden
) -> None:
    write_rules(model, "gaussian_blendshapes", anchor=anchor, lower_teeth=lower_teeth, mask="per_blendshape")
    avatar = read(model, options(blendshapes_golden))
    mix = avatar.groups[2].joint_mix
    assert avatar.rules.anchor == anchor and set(mix) == joints
    assert sum(mix.values()) == pytest.approx(1, abs=1e-5)
    for said in (anchor, lower_teeth, "per_blendshape"):
        assert said in str(avatar.provenance["notes"])
    assert RULES_FILE in [file["path"] for file in avatar.provenance["source_files"]]
    plain = read(blendshapes_golden.viewer, options(blendshapes_golden))
    assert plain.rules.anchor == "repeats" and len(plain.groups[2].joint_mix) == 3
    assert len(plain.provenance["notes"]) == 1


REFUSED: dict[str, tuple[Any, str]] = {
    "not JSON": ("{", r"not valid JSON \(line 1, column 2: "),
    "not UTF-8": (b"\xff\xfe\xfa", r"not valid JSON \(it is not UTF-8 text\)"),
    "deep": ("[" * 60000, r"not valid JSON \(it is nested too deeply\)"),
    "long number": ('{"system": ' + "9" * 60000 + "}", r"not valid JSON \(Exceeds the limit"),
    "too large": (" " * (MAX_BYTES + 1), f"is {MAX_BYTES + 1} bytes long; up to {MAX_BYTES}"),
    "a list": ([], "is not of the form "),
    "no system": ({"rules": {}}, "system: is for no system, .*splatting_avatar"),
    "units": ({"system": "splatting_avatar", "rules": {}, "training_units_per_metre": 0}, "training_units_per_metre"),
    "another system": ({"system": "gaussian_blendshapes", "rules": {}}, "is for 'gaussian_blendshapes', but"),
    "unknown rule": ({"scal": "none"}, "rules: 'scal' is not a rule of splatting_avatar; did you mean scale"),
    "unknown value": ({"scale": "cubic"}, "rules.scale: is 'cubic', expected one of none, log_area, linear_area"),
    "a value in lines": ({"scale": "a\nb" * 999}, r"rules.scale: is 'a\\nba"),
    **{f"{value}": ({"scale": value}, "rules.scale: is not text") for value in (1, ["none"], None)},
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refusals(name: str, run: Path) -> None:
    content, message = REFUSED[name]
    if isinstance(content, dict) and not {"system", "rules"} & set(content):
        content = {"system": "splatting_avatar", "rules": content}
    data = content if isinstance(content, str | bytes) else json.dumps(content)
    (run / RULES_FILE).write_bytes(data if isinstance(data, bytes) else data.encode())
    refused(f"^splatting_avatar: {run / RULES_FILE}.*{message}", read_run, run)
