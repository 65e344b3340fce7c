"""Files that are readable and wrong are found as the table says; sound ones raise no doubt."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_export.fit.names import BROW, EYE, JAW, MOUTH, Told, told
from tests.exporter.fit.misfits import Bases
from tests.exporter.fit.table import said
from tests.exporter.fit.wrong import __main__ as table
from tests.exporter.fit.wrong.__main__ import LINES
from tests.exporter.fit.wrong.inputs import Inputs
from tests.exporter.fit.wrong.line import Line, tried

SOUND = ("blendshapes", "head", "trained", "body", "points", "rigged", "lam")
CASES = [
    pytest.param(line, case, id=f"{line.mistake}: {case}", marks=pytest.mark.more if number else ())
    for line in LINES
    for number, case in enumerate(line.cases)
]


def stored() -> dict[tuple[str, str], str]:
    """(mistake, case) -> whether it is found."""
    return {(row["mistake"], row["case"]): row["found"] for row in table.stored()}


@pytest.fixture(scope="session")
def inputs(bases: Bases, tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    return Inputs.make(tmp_path_factory.mktemp("wrong"), bases)


@pytest.mark.parametrize(("line", "case"), CASES)
def test_it_is_found_as_the_table_says(line: Line, case: str, inputs: Inputs, tmp_path: Path) -> None:
    found = line.found(tried(line.cases[case], inputs, tmp_path / "case"))
    assert found == (stored()[line.mistake, case] == "yes")


def test_the_table_has_these_cases_and_no_false_alarm() -> None:
    every = {(line.mistake, case) for line in LINES for case in line.cases} | {("", one) for one in SOUND}
    assert stored().keys() == every
    assert [one for one in SOUND if stored()["", one] != "yes"] == []


@pytest.mark.parametrize("system", SOUND)
def test_sound_inputs_raise_no_doubt(system: str, inputs: Inputs) -> None:
    assert said(getattr(inputs, system)) == ""


@pytest.mark.parametrize(
    ("name", "place", "side", "rises"),
    [
        ("browInnerUp_L", BROW, 1, 1), ("browInnerUp", BROW, 0, 1), ("AK_09_EyeBlinkLeft", EYE, 1, -1),
        ("SR_08_Eye_Left_Right", EYE, None, 0), ("AU_61_EyesTurnLeft", EYE, None, 0), ("mouthLeft", MOUTH, None, 0),
        ("AK_33_MouthLeft", MOUTH, None, 0), ("mouthSmile_R", MOUTH, -1, 1), ("jawLeft", JAW, None, 0),
        ("HB_11_TongueDown", None, None, 0), ("left", None, 1, 0), ("exp_003", None, None, 0),
    ],
)  # fmt: skip
def test_what_a_name_tells(name: str, place: int | None, side: int | None, rises: int) -> None:
    assert told(name) == Told(place, side, rises)
