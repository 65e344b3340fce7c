"""The table of rules: sound, append-only, and the only list of names. Schemas say what it says."""

from __future__ import annotations

import ast
import re
from dataclasses import asdict
from pathlib import Path

import pytest

from avatar_runtime import rules as runtime_rules
from avatar_runtime.avatar import Rules
from avatar_runtime.checks.avatar import check_rule_values
from avatar_runtime.io.errors import AvatarError
from avatar_schema import families, rules, schema
from avatar_schema.generate import V1, schema_texts
from avatar_schema.validate import key_problems

ROOT = Path(__file__).parents[2]
NEEDS = {"rig", "rotation_joint", "displacement", "local_offset"}
PLACED = ("binding", "rotation", "position", "scale")  # rules whose values stand in families
# Codes of version 1.0. A line is never changed or taken out: packs hold these numbers.
CODES = {  # a rule: its values, in the order of their codes
    "binding": "none skin anchor joint_mix surface",
    "rotation": "vertex_quaternion vertex_quaternion_mean triangle_frame bary_vertex_lbs polar3 head_bone none",
    "position": "normal triangle_frame interpolated_normal",
    "scale": "none log_area linear_area=triangle_linear",
    "quaternion_sign": "largest_positive w_positive largest_positive_mirrored",
    "normal": "unit",
    "sh_direction": "inverse_rotation world",
    "late_morphs": "after_skin",
    "anchor": "repeats unique",
    "head_pose_in": "camera mesh",
    "background": "random per_view",
    "driving_mode": "names matrix none",
}


def test_codes_of_version_1_stay() -> None:
    for name, codes in CODES.items():
        kept = {(value, code) for code, at in enumerate(codes.split()) for value in at.split("=")}
        assert kept <= {(value.name, value.code) for value in rules()[name].values}


@pytest.mark.parametrize("name", rules())
def test_a_rule_is_sound(name: str) -> None:
    rule = rules()[name]
    assert len(set(rule.names())) == len(rule.values) and len(rule.about) > 15 and rule.enums
    own = [value.code for value in rule.values if value.same_formula_as is None]
    assert len(set(own)) == len(own), "two formulas under one code"
    for value in rule.values:
        assert re.fullmatch(r"[a-z][a-z0-9_]*", value.name) and 0 <= value.code < 256
        assert len(value.source) > 5
        assert set(value.needs) <= NEEDS
        assert set(value.families) <= set(families()) and bool(value.families) == (name in PLACED)
        if value.same_formula_as is not None:
            assert rule.value(value.same_formula_as).code == value.code
        if value.mirror_of is not None:
            assert rule.value(value.mirror_of).mirror_of is None


def test_an_unknown_value_is_named() -> None:
    with pytest.raises(KeyError, match="rule scale has no value 'cubic'; it has none, log_area"):
        runtime_rules.code("scale", "cubic")
    wrong = Rules("vertex_quaternion", scale="cubic")
    (problem,) = key_problems(asdict(wrong) | {"normal": "unit", "late_morphs": "after_skin"}, "rules")
    assert problem.path == "$.scale" and "'cubic'" in problem.message
    with pytest.raises(AvatarError, match="'cubic' is not one of none, log_area, "):
        check_rule_values(wrong)


def test_the_schemas_have_the_enums_of_the_table() -> None:
    """Byte by byte what `python -m avatar_schema` writes."""
    assert schema_texts() == {name: (V1 / name).read_text("utf-8") for name in schema_texts()}
    node = schema("avatar")["properties"]["rules"]["properties"]
    for name in node.keys() - {"rotation_joint"}:
        assert tuple(node[name]["enum"]) == rules()[name].names()
    embedded = schema("embedding")["properties"]["rules"]["properties"]
    assert set(embedded["rotation"]["enum"]) == set(rules()["rotation"].names()) - set(
        rules()["rotation"].names("joints")
    )


NAMED_LISTS = [set(rule.names()) for rule in rules().values() if len(rule.values) > 1]
NAMED_LISTS += [set(rules()[name].names(family)) for family in families() for name in ("rotation", "scale")]


def strings(node: ast.AST) -> set[object]:
    """Those of a literal collection, or the keys of a dictionary that does not lead to formulas."""
    found: list[ast.expr | None] = []
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        found = [*node.elts]
    elif isinstance(node, ast.Dict) and all(isinstance(value, ast.Constant) for value in node.values):
        found = node.keys
    return {element.value for element in found if isinstance(element, ast.Constant)}


@pytest.mark.parametrize("package", ["schema", "engine_shaders", "runtime", "exporter", "trainer"])
def test_no_python_repeats_the_values_of_a_rule(package: str) -> None:
    for path in (ROOT / package).rglob("avatar_*/**/*.py"):
        found = [strings(node) for node in ast.walk(ast.parse(path.read_text("utf-8")))]
        assert not [
            values for values in NAMED_LISTS for have in found if len(values) > 1 and values <= have
        ], path
