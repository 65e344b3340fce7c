"""The table of rules: sound, append-only, and the only list of names. Schemas, SPEC.md and HLSL say what it says."""

from __future__ import annotations

import ast
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from avatar_runtime import rules as runtime_rules
from avatar_runtime.stages import surface
from avatar_schema import __main__ as command
from avatar_schema import families, generate, rules, schema
from avatar_schema.generate import V1, schema_texts, with_array

ROOT = Path(__file__).parents[2]
SPEC = (ROOT / "schema" / "SPEC.md").read_text("utf-8")
SECTIONS = {n: body for n, body in re.findall(r"^## (\d+)\. (.*?)(?=^## |\Z)", SPEC, re.M | re.S)}
NEEDS = {"rig", "rotation_joint", "displacement", "local_offset"}
PLACED = ("binding", "rotation", "position", "scale")  # rules whose values stand in families
PACKAGES = (
    "schema/avatar_schema",
    "engine_shaders/avatar_shaders",
    "runtime/avatar_runtime",
    "exporter/avatar_export",
    "trainer/avatar_trainer",
)

# Codes of version 1.0. A line is never changed or taken out: packs hold these numbers.
CODES = {
    "binding": {"none": 0, "skin": 1, "anchor": 2, "joint_mix": 3, "surface": 4},
    "rotation": {
        "vertex_quaternion": 0,
        "vertex_quaternion_mean": 1,
        "triangle_frame": 2,
        "bary_vertex_lbs": 3,
        "polar3": 4,
        "head_bone": 5,
        "none": 6,
    },
    "position": {"normal": 0, "triangle_frame": 1, "interpolated_normal": 2},
    "scale": {"none": 0, "log_area": 1, "linear_area": 2, "triangle_linear": 2},
    "quaternion_sign": {"largest_positive": 0, "w_positive": 1, "largest_positive_mirrored": 2},
    "normal": {"unit": 0},
    "sh_direction": {"inverse_rotation": 0, "world": 1},
    "late_morphs": {"after_skin": 0},
    "anchor": {"repeats": 0, "unique": 1},
    "head_pose_in": {"camera": 0, "mesh": 1},
    "background": {"random": 0, "per_view": 1},
    "driving_mode": {"names": 0, "matrix": 1, "none": 2},
}


def test_codes_of_version_1_stay() -> None:
    for name, codes in CODES.items():
        assert codes.items() <= {value.name: value.code for value in rules()[name].values}.items()


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


def test_every_family_has_every_kind_of_rule() -> None:
    for family in families().values():
        for name in PLACED:
            assert rules()[name].names(family.name) or (name == "position" and not family.embedded)


def test_an_unknown_value_is_named() -> None:
    with pytest.raises(KeyError, match="rule scale has no value 'cubic'; it has none, log_area"):
        runtime_rules.code("scale", "cubic")


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


def test_the_command_finds_and_mends_a_schema_that_differs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = Path(shutil.copytree(V1, tmp_path / "v1"))
    monkeypatch.setattr(command, "V1", folder)
    monkeypatch.setattr(command, "schema_texts", lambda: generate.schema_texts(folder))
    path = folder / "avatar.schema.json"
    right = path.read_text("utf-8")
    path.write_text(right.replace('"world"', '"worlds"'), "utf-8")
    monkeypatch.setattr("sys.argv", ["avatar_schema", "--check"])
    assert command.main() == 1
    assert (
        capsys.readouterr().out
        == "v1/avatar.schema.json differs from v1/rules.json: run python -m avatar_schema\n"
    )
    monkeypatch.setattr("sys.argv", ["avatar_schema"])
    assert command.main() == 0 and path.read_text("utf-8") == right
    monkeypatch.setattr("sys.argv", ["avatar_schema", "--check"])
    assert command.main() == 0 and capsys.readouterr().out == ""


def test_an_array_is_replaced_where_the_pointer_leads() -> None:
    text = '{\n  "a": [1, {"b": ["x"]}],\n  "c": ["x"]\n}\n'
    assert with_array(text, "/a/1/b", ["x"]) == text
    assert with_array(text, "/a/1/b", ["y", "z"]) == text.replace('{"b": ["x"]}', '{"b": ["y", "z"]}')
    long = [f"name_{i}" for i in range(30)]
    made = with_array(text, "/c", long)
    assert json.loads(made)["c"] == long and max(map(len, made.splitlines())) <= generate.WIDTH
    for nowhere in ("/d", "/a/2", "/a/0/b"):
        with pytest.raises(KeyError):
            with_array(text, nowhere, [])


@pytest.mark.parametrize("name", rules())
def test_the_section_of_a_rule_names_its_values(name: str) -> None:
    rule = rules()[name]
    named = set(re.findall(r"`([^`\n]+)`", SECTIONS[rule.spec]))
    assert set(rule.names()) <= named


def test_families_are_the_rows_of_the_specification() -> None:
    table = SECTIONS["7"].split("| rotation | position | scale | source |\n")[1].split("\n\n")[0]
    rows = [
        tuple(tuple(re.findall(r"`([^`]+)`", cell)) for cell in line.split("|")[1:4])
        for line in table.splitlines()[1:]
    ]
    assert tuple(rows) == runtime_rules.SURFACE_FAMILIES


def test_every_commit_of_a_source_stands_in_the_specification() -> None:
    sources = " ".join(value.source for rule in rules().values() for value in rule.values)
    commits = set(re.findall(r"\b[0-9a-f]{7}\b", sources))
    assert len(commits) >= 4 and not [commit for commit in commits if commit not in SPEC]


def test_numpy_has_a_formula_for_every_value() -> None:
    assert set(surface.SIGNED) == set(runtime_rules.QUATERNION_SIGNS)
    assert set(surface.POSITIONS) == set(runtime_rules.POSITION_RULES)
    assert set(surface.SCALES) == set(runtime_rules.SCALE_RULES)
    assert set(surface.TURNS) == set(runtime_rules.ROTATION_RULES) - set(runtime_rules.SKIN_ROTATIONS)


def listed(node: ast.AST) -> Iterator[str]:
    """The strings of a literal collection, or the keys of a dictionary that does not lead to formulas."""
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        elements: list[ast.expr | None] = list(node.elts)
    elif isinstance(node, ast.Dict) and all(isinstance(value, ast.Constant) for value in node.values):
        elements = list(node.keys)
    else:
        return
    for element in elements:
        if isinstance(element, ast.Constant) and isinstance(element.value, str):
            yield element.value


def repeated(text: str) -> set[str]:
    """Names of the rules that the Python `text` lists all values of."""
    many = {rule.name: set(rule.names()) for rule in rules().values() if len(rule.values) > 1}
    many |= {
        f"{name} of {f}": set(rules()[name].names(f)) for f in families() for name in ("rotation", "scale")
    }
    lists = [set(listed(node)) for node in ast.walk(ast.parse(text))]
    return {name for name, values in many.items() for found in lists if len(values) > 1 and values <= found}


@pytest.mark.parametrize("package", PACKAGES)
def test_no_python_repeats_the_values_of_a_rule(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    found = {str(path.relative_to(ROOT)): repeated(path.read_text("utf-8")) for path in files}
    assert len(files) > 4 and not {path: names for path, names in found.items() if names}


def test_a_repeated_list_is_seen() -> None:
    assert repeated('x = ("inverse_rotation", "world")') == {"sh_direction"}
    assert repeated('x = {"none": 0, "log_area": 1, "linear_area": 2}') == {"scale of surface_by_vertices"}
    assert repeated('x = {"none": f, "log_area": g, "linear_area": h, "triangle_linear": h}') == set()
