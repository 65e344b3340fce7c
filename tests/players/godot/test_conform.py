"""Every stage of every kit avatar on Godot's RenderingDevice, and the planted faults of the kernels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tools.godot.build import HERE, build

from avatar_export.packing.reference import MINI
from tests.conformance.avatars import AVATARS
from tests.conformance.faults import FAULTS, Fault, FaultyShaders
from tests.measured import Measure
from tests.players.godot.desk import Job
from tests.players.played_cases import HEAD, played_cases

pytestmark = pytest.mark.godot
FILES = (  # of a reference: a pack, what it is asked, numbers
    (MINI, "cases.json", "vectors.safetensors"),
    (HEAD, "driving.json", "driving.safetensors"),
)


def conform(job: Job, folders: dict[str, Path], binary: Path | None = None) -> list[dict[str, Any]]:
    """The rows of all references."""
    for name, folder in folders.items():
        for files in FILES:
            if (folder / files[1]).exists():
                job.say("conform", f"{name} {files[1]}", str(folder), *files)
    job.play(binary)
    reports = {key: said for key, said in job.answers.items() if key.startswith("conform ")}
    assert reports and not {key: said["error"] for key, said in reports.items() if said["error"]}
    return [{"of": key.split()[1], **row} for key, said in reports.items() for row in said["rows"]]


def test_every_stage_of_every_avatar_is_within_its_tolerance(
    kit: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, measured: Measure
) -> None:
    """The kit's avatars, and those under every rule that all players play, the distilled ones among them."""
    played = {name.replace(" ", "_"): case.folder for name, case in played_cases(tmp_path_factory).items()}
    rows = conform(Job(tmp_path), {**{name: kit / name for name in AVATARS}, **played})
    stages = {
        "driving",
        "joints",
        "morph",
        "skin",
        "blend",
        "bind",
        "activate",
        "project",
        "shadow",
        "light",
        "sort",
        "raster",
    }
    assert stages <= {row["stage"] for row in rows} and {row["of"] for row in rows} == {*AVATARS, *played}
    measured("godot, stages, share of the tolerance", max(row["used"] for row in rows), 1)
    assert not [row for row in rows if not row["passed"]]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_engine_finds_a_planted_fault(fault: Fault, kit: Path, tmp_path: Path) -> None:
    hlsl = tmp_path / "hlsl"
    FaultyShaders(fault, hlsl)
    rows = conform(Job(tmp_path), {fault.avatar: kit / fault.avatar}, build(HERE, tmp_path, hlsl))
    assert {row["stage"] for row in rows if not row["passed"]} == {*fault.stages}
