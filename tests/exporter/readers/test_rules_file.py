"""rules.json beside a checkpoint: entries that change the avatar, entries that only describe, refused entries."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.options import ReadOptions
from avatar_export.readers.gaussian_blendshapes import reader as gaussian_blendshapes
from avatar_export.readers.psavatar import reader as psavatar
from avatar_export.readers.rules_file import MAX_BYTES, RULES_FILE, read_rules
from avatar_export.readers.splatting_avatar import reader as splatting_avatar
from avatar_export.readers.table import READERS, read
from avatar_runtime.avatar import Rules
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.exporter.readers.splatting_files import notes_of, read_run
from tests.exporter.readers.test_gaussian_blendshapes import options
from tests.golden import BlendshapesGolden
from tests.hostile import MANGLING, only_avatar_errors

CODE = Rules("vertex_quaternion", None, "inverse_rotation", scale="log_area")
PAPER = {"scale": "linear_area", "position": "interpolated_normal", "rotation": "vertex_quaternion_mean"}
MODULES = {module.SYSTEM: module for module in (gaussian_blendshapes, psavatar, splatting_avatar)}


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
        ({}, {}, {}, "mesh scaling on (config.yaml model.with_mesh_scaling)"),
        (PAPER, {}, PAPER, "mesh scaling linear (rules.json); SH direction inverse_rotation (config.yaml pipe."),
        (PAPER, {}, PAPER, "; position interpolated_normal (rules.json); rotation vertex_quaternion_mean (rules.json)"),
        ({"position": "interpolated_normal"}, {}, {"position": "interpolated_normal"}, "position interpolated_normal"),
        ({"rotation": "vertex_quaternion_mean"}, {}, {"rotation": "vertex_quaternion_mean"}, "quaternion_mean (rules"),
        ({"rotation": "vertex_quaternion", "position": "normal"}, {}, {}, "; rotation vertex_quaternion (rules.json)"),
        ({"scale": "none"}, {}, {"scale": "none"}, "mesh scaling off (rules.json)"),
        ({"sh_direction": "world"}, {}, {"sh_direction": "world"}, "SH direction world (rules.json)"),
        (PAPER, {"mesh_scaling": True}, PAPER | {"scale": "log_area"}, "mesh scaling on (--mesh-scaling)"),
        (PAPER, {"mesh_scaling": False}, PAPER | {"scale": "none"}, "mesh scaling off (--mesh-scaling)"),
        ({"sh_direction": "world"}, {"sh_direction": "inverse_rotation"}, {}, "inverse_rotation (--sh-direction)"),
    ],
)  # fmt: skip
def test_splatting_avatar_is_played_by_them(
    rules: dict[str, str], given: dict[str, Any], want: dict[str, str], said: str, run: Path
) -> None:
    """config.yaml says log_area and inverse_rotation; an option counts more than both."""
    write_rules(run, "splatting_avatar", **rules)
    avatar = read_run(run, **given)
    assert avatar.rules == replace(CODE, **want)
    assert said in avatar.provenance["notes"][0]
    assert RULES_FILE in [file["path"] for file in avatar.provenance["source_files"]]


def test_without_the_file_nothing_is_said_of_it(run: Path) -> None:
    plain = read_run(run)
    assert plain.rules == CODE and RULES_FILE not in json.dumps(plain.provenance)
    write_rules(run, "splatting_avatar")
    assert read_run(run).provenance["notes"] == plain.provenance["notes"]
    (run / RULES_FILE).unlink()
    (run / RULES_FILE).mkdir()
    assert read_run(run).rules == CODE


def test_it_lies_beside_config_yaml_or_beside_the_ply(run: Path) -> None:
    path = write_rules(run, "splatting_avatar", **PAPER)
    write_rules(run.parent, "splatting_avatar", position="normal")
    assert read_run(run / "point_cloud" / "iteration_30000").rules.position == "interpolated_normal"
    path.rename(run / "point_cloud" / "iteration_30000" / RULES_FILE)
    assert read_run(run).rules.position == "interpolated_normal"


def test_what_is_only_recorded_is_noted_and_changes_nothing(run: Path) -> None:
    plain = read_run(run)
    write_rules(run, "splatting_avatar", embedding="walking")
    noted = read_run(run)
    assert noted.rules == plain.rules
    assert notes_of(noted)[1] == "rules.json records how it was trained: embedding walking"


def test_the_paper_is_drawn_elsewhere_than_the_code(run: Path) -> None:
    """The binding pose too: its heights are those of the rule."""
    by_code = read_run(run)
    write_rules(run, "splatting_avatar", **PAPER)
    by_paper = read_run(run)
    assert abs(by_code.gaussians.mean - by_paper.gaussians.mean).max() > 1e-5
    assert abs(Player(by_paper).animate(Pose()).mean - by_paper.gaussians.mean).max() < 1e-7


@pytest.mark.parametrize(("lower_teeth", "joints"), [("mix", {"root", "neck", "jaw"}), ("jaw", {"jaw"})])
@pytest.mark.parametrize("anchor", ["repeats", "unique"])
def test_gaussian_blendshapes_is_played_by_them(
    anchor: str, lower_teeth: str, joints: set[str], model: Path, blendshapes_golden: BlendshapesGolden
) -> None:
    write_rules(model, "gaussian_blendshapes", anchor=anchor, lower_teeth=lower_teeth, mask="per_blendshape")
    avatar = read(model, options(blendshapes_golden))
    mix = avatar.groups[2].joint_mix
    assert (
        avatar.rules.anchor == anchor
        and set(mix) == joints
        and sum(mix.values()) == pytest.approx(1, abs=1e-5)
    )
    *said, fit = avatar.provenance["notes"]
    assert said == [
        f"anchor {anchor} (rules.json)",
        f"lower_teeth {lower_teeth} (rules.json)",
        "rules.json records how it was trained: mask per_blendshape",
    ]
    assert RULES_FILE in [file["path"] for file in avatar.provenance["source_files"]]
    plain = read(blendshapes_golden.viewer, options(blendshapes_golden))
    assert plain.rules.anchor == "repeats" and len(plain.groups[2].joint_mix) == 3
    assert plain.provenance["notes"] == [fit] and fit.startswith(
        "median distance from the mesh of body_model.npz"
    )


def test_teeth_on_the_jaw_move_as_the_jaw_does(model: Path, blendshapes_golden: BlendshapesGolden) -> None:
    write_rules(model, "gaussian_blendshapes", lower_teeth="jaw")
    avatar = read(model, options(blendshapes_golden))
    assert avatar.rig is not None
    player, turned = Player(avatar), Pose({avatar.expression_names[0]: 1.5})
    turned.joints["jaw"] = [[1, 0, 0, 0.01], [0, 0.8, -0.6, 0], [0, 0.6, 0.8, 0], [0, 0, 0, 1]]
    jaw = player.posed(turned).skin_matrix[avatar.rig.joint_names.index("jaw")].astype("f8")
    rows = slice(avatar.groups[2].first, None)
    want = avatar.gaussians.mean[rows] @ jaw[:3, :3].T + jaw[:3, 3]
    assert abs(player.animate(turned).mean[rows] - want).max() < 1e-6


@pytest.mark.parametrize("system", MODULES)
def test_every_value_of_every_rule_is_known(system: str, tmp_path: Path) -> None:
    played, recorded = MODULES[system].PLAYED_RULES, MODULES[system].RECORDED_RULES
    assert not set(played) & set(recorded)
    for name, values in {**played, **recorded}.items():
        for value in values:
            path = write_rules(tmp_path, system, **{name: value})
            trained = read_rules(path, system, played, recorded)
            assert {**trained.played, **trained.recorded} == {name: value}
            assert (name in trained.played) == (name in played)


def test_systems_lists_the_file() -> None:
    for reader in READERS:
        assert any(RULES_FILE in line for line in reader.files) == (reader.system in MODULES)


REFUSED: dict[str, tuple[Any, str]] = {
    "not JSON": ("{", r"is not valid JSON \(line 1, column 2: "),
    "not UTF-8": (b"\xff\xfe\xfa", r"is not valid JSON \(it is not UTF-8 text\)"),
    "deep": ("[" * 60000, r"is not valid JSON \(it is nested too deeply\)"),
    "long number": ('{"system": ' + "9" * 60000 + "}", r"is not valid JSON \(Exceeds the limit"),
    "too large": (" " * (MAX_BYTES + 1), f"is {MAX_BYTES + 1} bytes long; up to {MAX_BYTES} are read"),
    "a list": ([], "is not of the form "),
    "no rules": ({"system": "splatting_avatar"}, "is not of the form "),
    "rules in a list": ({"system": "splatting_avatar", "rules": ["scale"]}, "is not of the form "),
    "no system": (
        {"rules": {}},
        "system: is for no system, but the checkpoint beside it is of splatting_avatar",
    ),
    "another system": ({"system": "gaussian_blendshapes", "rules": {}}, "is for 'gaussian_blendshapes', but"),
    "a system in lines": ({"system": "a\nb\u2028" * 99, "rules": {}}, r"is for 'a\\nb\\u2028a"),
    "unknown rule": ({"scal": "none"}, "rules: 'scal' is not a rule of splatting_avatar; did you mean scale"),
    "a rule of another system": ({"anchor": "unique"}, "'anchor' is not a rule of splatting_avatar"),
    "a rule in lines": ({"x\n" * 999: "none"}, r"rules: 'x\\nx"),
    "unknown value": (
        {"scale": "cubic"},
        "rules.scale: is 'cubic', expected one of none, log_area, linear_area",
    ),
    "a value of GaussianAvatars": (
        {"scale": "triangle_linear"},
        "rules.scale: is 'triangle_linear', expected one of",
    ),
    "an unknown recorded value": (
        {"embedding": "flying"},
        "rules.embedding: is 'flying', expected one of walking",
    ),
    "a value in lines": ({"scale": "a\nb" * 999}, r"rules.scale: is 'a\\nba"),
    "a number": ({"scale": 1}, "rules.scale: is not text, expected one of"),
    "a list as a value": ({"scale": ["none"]}, "rules.scale: is not text, expected one of"),
    "null": ({"scale": None}, "rules.scale: is not text, expected one of"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_are_one_line(name: str, run: Path) -> None:
    content, message = REFUSED[name]
    if isinstance(content, dict) and not {"system", "rules"} & set(content):
        content = {"system": "splatting_avatar", "rules": content}
    data = content if isinstance(content, str | bytes) else json.dumps(content)
    (run / RULES_FILE).write_bytes(data if isinstance(data, bytes) else data.encode())
    with pytest.raises(AvatarError, match=message) as caught:
        read_run(run)
    line = str(caught.value)
    assert "\n" not in line and len(line) < 600 and line.startswith(f"splatting_avatar: {run / RULES_FILE}")


def test_gaussian_blendshapes_refuses_too(model: Path) -> None:
    for rules, message in (
        ({"anchor": "once"}, "rules.anchor: is 'once', expected one of repeats, unique"),
        ({"scale": "linear_area"}, "'scale' is not a rule of gaussian_blendshapes"),
    ):
        write_rules(model, "gaussian_blendshapes", **rules)
        with pytest.raises(AvatarError, match=f"gaussian_blendshapes: .*rules.json: .*{message}"):
            read(model, ReadOptions(no_rig=True))


@pytest.fixture(scope="module")
def scratch(tmp_path_factory: pytest.TempPathFactory) -> Callable[[bytes], Path]:
    path = tmp_path_factory.mktemp("rules") / RULES_FILE

    def write(data: bytes) -> Path:
        path.write_bytes(data)
        return path

    return write


@MANGLING
@given(st.recursive(st.none() | st.text() | st.integers() | st.floats(), lambda inner: st.dictionaries(
    st.sampled_from(["system", "rules", "scale", "splatting_avatar", "x"]), inner)))  # fmt: skip
def test_no_document_raises_anything_else(scratch: Callable[[bytes], Path], document: Any) -> None:
    path = scratch(json.dumps(document).encode())
    known = splatting_avatar.PLAYED_RULES, splatting_avatar.RECORDED_RULES
    only_avatar_errors(lambda: read_rules(path, "splatting_avatar", *known))
