"""Every stage of every kit avatar on Godot's RenderingDevice, and the planted faults of the kernels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tools.godot.build import HERE, build

from avatar_export.packing.reference import MINI
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import driving_facts, pack
from avatar_runtime.packs import decode_pack
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import cases_of
from tests.conformance.faults import FAULTS, Fault, FaultyShaders
from tests.measured import Measure
from tests.players.godot.desk import Job
from tests.players.played_cases import HEAD, played_cases, vectors_of
from tests.session.shared_folder import made_once

pytestmark = pytest.mark.godot
FILES = (  # of a reference: a pack, what it is asked, numbers
    (MINI, "cases.json", "vectors.safetensors"),
    (HEAD, "driving.json", "driving.safetensors"),
)


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The kit's avatars and cases, as packs: a folder for each."""

    def make(folder: Path) -> Path:
        for name, made in AVATARS.items():
            source = made()
            file = pack([source], Fineness(), driving_facts(source)).file
            avatar = decode_pack(file, name).avatar
            (folder / name).mkdir()
            for part, data in {HEAD: file, **vectors_of(avatar, cases_of(name, avatar))}.items():
                (folder / name / part).write_bytes(data)
        return folder

    return made_once(tmp_path_factory, "godot_kit", make)


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
    stages = {"driving", "joints", "morph", "skin", "blend", "bind", "activate", "project", "sort", "raster"}
    assert stages <= {row["stage"] for row in rows} and {row["of"] for row in rows} == {*AVATARS, *played}
    measured("godot, stages, share of the tolerance", max(row["used"] for row in rows), 1)
    assert not [row for row in rows if not row["passed"]]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_engine_finds_a_planted_fault(fault: Fault, kit: Path, tmp_path: Path) -> None:
    hlsl = tmp_path / "hlsl"
    FaultyShaders(fault, hlsl)
    rows = conform(Job(tmp_path), {fault.avatar: kit / fault.avatar}, build(HERE, tmp_path, hlsl))
    assert {row["stage"] for row in rows if not row["passed"]} == {*fault.stages}
