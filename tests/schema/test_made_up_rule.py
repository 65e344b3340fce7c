"""A new rule is a row in the table and a formula in each language: nothing else names it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_runtime.avatar import Rules
from avatar_runtime.checks.avatar import check_rule_values
from avatar_runtime.io.errors import AvatarError
from avatar_schema.validate import key_problems
from tests.schema import made_up_rule

ROOT = Path(__file__).parents[2]
SOURCES = ("schema", "engine_shaders", "runtime", "trainer")
GROWN = np.log(1.5)  # of an edge: areas grow by its square, so sqrt_area adds this to the log scale


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources with the made-up rule; schemas and shaders are made again by their commands."""
    root = tmp_path_factory.mktemp("copy")
    for name in SOURCES:
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    made_up_rule.patch(root)
    for module in ("avatar_schema", "avatar_shaders"):
        run(root, "-m", module)
    return root


def run(root: Path, *arguments: str) -> str:
    path = [*(str(root / name) for name in SOURCES), str(ROOT / "exporter"), str(ROOT)]
    # Without the compiler Numba's kernels run as Python: the same formulas and codes in seconds less.
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-P", *arguments], env=environment, capture_output=True, text=True, cwd=root
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_row_and_the_formulas_are_a_rule(copy: Path) -> None:
    told = json.loads(run(copy, str(ROOT / "tests" / "schema" / "made_up_rule.py")))
    assert Path(told["schema"]).is_relative_to(copy)
    assert told["problems"] == []
    growth = {name: np.array(values) for name, values in told["growth"].items()}
    assert set(growth) == {"reference", "cpu", "gl", "trainer"}
    for name, values in growth.items():
        np.testing.assert_allclose(values, GROWN, atol=1e-5, err_msg=name)


def test_commands_put_it_into_schemas_and_shaders(copy: Path) -> None:
    for file in ("avatar", "embedding"):
        schema: dict[str, Any] = json.loads(
            (copy / f"schema/avatar_schema/v1/{file}.schema.json").read_text("utf-8")
        )
        assert made_up_rule.NAME in schema["properties"]["rules"]["properties"]["scale"]["enum"]
    assert run(copy, "-m", "avatar_schema", "--check") == ""
    header = (copy / "engine_shaders/avatar_shaders/hlsl/rules.hlsli").read_text("utf-8")
    assert "#define AVATAR_SCALE_SQRT_AREA 3\n" in header
    glsl = (copy / "engine_shaders/avatar_shaders/glsl/bind_surface.comp").read_text("utf-8")
    assert "constants.scale_rule == 3u" in glsl


def test_without_its_row_it_is_refused() -> None:
    rules = Rules("vertex_quaternion", scale=made_up_rule.NAME)
    said = asdict(rules) | {"normal": "unit", "late_morphs": "after_skin"}
    (problem,) = key_problems(said, "rules")
    assert problem.path == "$.scale" and "'sqrt_area' is unknown to this reader" in problem.message
    with pytest.raises(AvatarError, match="'sqrt_area' is not one of none, log_area, "):
        check_rule_values(rules)
