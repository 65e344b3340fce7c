"""The JavaScript that ports start from reads the vectors as Python does, and two stages in it pass."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_runtime.conformance.files import ROWS, VERTICES
from avatar_runtime.conformance.steps import step_tensors
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import DATA
from tests.conformance.references import committed
from tests.interop.clients import node_program

HERE = Path(__file__).parent


def answer(folder: Path, **changes: dict[int, float | str]) -> dict[str, Any]:
    """What `reader.mjs` says; `changes` are to what is given for a tensor, __ for / and ___ for a dot in its name."""
    named = {name.replace("___", ".").replace("__", "/"): change for name, change in changes.items()}
    done = subprocess.run(
        [node_program(), str(HERE / "reader.mjs")],
        input=json.dumps({"folder": str(folder), "changes": named}),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def failing(avatar: str, **changes: dict[int, float | str]) -> set[str]:
    return {tensor for tensor, holds in answer(DATA / avatar, **changes)["judged"] if not holds}


@pytest.mark.parametrize("avatar", AVATARS)
def test_javascript_reads_every_tensor_and_two_stages_hold(avatar: str) -> None:
    reference, found = committed(avatar), answer(DATA / avatar)
    names = {ROWS, VERTICES}.union(*(step_tensors(s) for v in reference.cases for s in v.steps))
    assert found["sums"].keys() == names
    for name in names:
        length, total = found["sums"][name]
        assert length == reference.tensors[name].size
        assert total == pytest.approx(
            float(reference.tensors[name].astype("float64").sum()), rel=1e-9, abs=1e-9
        )
    outputs = {e.tensor for v in reference.cases for step in v.steps for e in step.outputs.values()}
    assert {tensor for tensor, _ in found["judged"]} == outputs
    assert all(holds for _, holds in found["judged"])


def value(tensor: str, index: int, avatar: str = "edges") -> float:
    return float(committed(avatar).tensors[tensor].ravel()[index])


def drawn_rows() -> list[int]:
    return [int(row) for row in np.flatnonzero(committed("edges").tensors["thresholds/project/radius"])]


def test_javascript_says_what_is_beyond_its_tolerance() -> None:
    name = "posed/activate/scale"
    scale = value(name, 4, "still")
    assert failing("still", posed__activate__scale={4: scale * (1 + 60 * 2.0**-24)}) == set()
    assert failing("still", posed__activate__scale={4: scale * (1 + 70 * 2.0**-24)}) == {name}
    assert failing("still", posed__activate__scale={4: "nan"}) == {name}
    length = committed("still").tensors[name].size
    assert failing("still", posed__activate__scale={length - 3: "end"}) == {name}
    assert failing("still", posed__activate__scale={length: 1.0}) == {name}


def test_javascript_knows_that_a_quaternion_has_two_signs() -> None:
    name = "posed/bind/quat_wxyz"
    turned = {i: -value(name, i, "skin_polar") for i in range(8, 12)}
    assert failing("skin_polar", posed__bind__quat_wxyz=turned) == set()
    assert failing("skin_polar", posed__bind__quat_wxyz={8: turned[8]}) == {name}
    mean = {i: -value("posed/bind/mean", i, "skin_polar") for i in range(6, 9)}
    assert failing("skin_polar", posed__bind__mean=mean) == {"posed/bind/mean"}


def test_javascript_compares_an_order_to_the_bit() -> None:
    name = "thresholds/sort/order"
    first, second = (value(name, i) for i in (0, 1))
    assert failing("edges", thresholds__sort__order={0: second, 1: first}) == {name}


def test_javascript_allows_what_may_flip_and_no_more() -> None:
    radius, depth = "thresholds/project/radius", "thresholds/project/depth"
    a, b = drawn_rows()[:2]
    assert failing("edges", thresholds__project__radius={a: value(radius, a) + 1}) == set()
    assert failing("edges", thresholds__project__radius={a: value(radius, a) + 2}) == {radius}
    hidden = int(np.flatnonzero(committed("edges").tensors[radius] == 0)[0])
    for row in (a, hidden):
        assert failing("edges", thresholds__project__radius={row: "nan"}) == {radius}
    gone = {a: 0}
    assert failing("edges", thresholds__project__radius=gone, thresholds__project__depth=gone) == set()
    assert failing("edges", thresholds__project__depth=gone) == {depth}
    both = {row: value(radius, row) - 1 for row in (a, b)}
    assert failing("edges", thresholds__project__radius=both) == {radius}
    name = "thresholds/raster.engine/transmittance"
    off = {0: value(name, 0) + 3e-3}
    assert failing("edges", thresholds__raster___engine__transmittance=off) == set()
    off[1] = value(name, 1) + 3e-3
    assert failing("edges", thresholds__raster___engine__transmittance=off) == {name}
    assert failing("edges", thresholds__raster___engine__transmittance={0: value(name, 0) + 0.5}) == {name}


def test_javascript_lets_the_edge_of_a_shadow_flip() -> None:
    """A few texels may be anything, more may not."""
    name = "studio/shadow/shadow"
    most = committed("lit_head").cases[1].steps[6].outputs["shadow"].most_flips
    assert failing("lit_head", studio__shadow__shadow=dict.fromkeys(range(most), 0.25)) == set()
    assert failing("lit_head", studio__shadow__shadow=dict.fromkeys(range(most + 1), 0.25)) == {name}
