"""Light in the native player: pictures by backend `gl`, and what a change of light alone does to the next one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_runtime.light import Light
from avatar_runtime.packs import decode_pack
from tests.measured import Measure
from tests.players.native.gles import Job, desk_program
from tests.players.vectors.lit_images import LIGHTS, PLACE, STILL, apart, avatars, packed_avatars, wanted
from tests.runtime.backends import gl_cases

KINDS = ("es", "gl", pytest.param("d3d11", marks=pytest.mark.players))
DIRECT = np.dtype([("place", "<f8", 3), ("colour", "<f8", 3), ("point", "<i4")], align=True)
LIGHT = np.dtype(
    [(name, "<u4") for name in ("struct_size", "count", "shadow")]
    + [("ambient", "<f8", (9, 3)), ("lights", DIRECT, 4)],
    align=True,
)


def file_of(job: Job, light: Light) -> Path:
    """An AvatarLight."""
    said = np.zeros(1, LIGHT)
    said["struct_size"], said["count"], said["shadow"] = LIGHT.itemsize, len(light.lights), light.shadow
    said["ambient"] = light.ambient
    for at, one in enumerate(light.lights):
        said["lights"][0, at] = (one.place, one.colour, one.point)
    return job.file(said.tobytes())


@pytest.fixture(scope="module", params=KINDS)
def played(request: pytest.FixtureRequest, kit: Path, tmp_path_factory: pytest.TempPathFactory) -> Job:
    """Each avatar in each light; the first one in more ways."""
    job = Job(tmp_path_factory.mktemp(f"light_{request.param}"))
    job.say("begin", request.param)
    job.camera(gl_cases.camera())
    for name, (file, _) in packed_avatars().items():
        pack = job.folder / f"{name}.avatar"
        pack.write_bytes(file)
        own = decode_pack(pack.read_bytes(), name).avatar  # arrays of a pose are in the pack's frame
        pose = gl_cases.pose_of(own)
        job.add(pack, own, pose)
        job.draw(f"{name}_unlit")
        for said, light in LIGHTS.items():
            job.say("light", 0, file_of(job, light))
            job.draw(f"{name}_{said}")
        job.say("pose", 0, job.pose(own, pose, PLACE))
        job.draw(f"{name}_placed")
        job.say("light", 0, "-")
        job.say("pose", 0, job.pose(own, pose))
        job.draw(f"{name}_off")
        if name == "full":
            job.say("light", 0, file_of(job, LIGHTS["sun"]))
            job.draw("again")
            job.say("frames", 80)
            job.say("lose")
            job.say("pose", 0, job.pose(own, pose))
            job.draw("restored")
        job.say("clear")
    for name in ("lit_head", "lit_world", "lit_joints"):
        job.say("conform", kit / name, "cases")
    job.say("end")
    job.said = job.run(desk_program(request.param))
    return job


@pytest.mark.parametrize("name", avatars())
def test_lit_avatars_look_as_by_backend_gl(played: Job, name: str, measured: Measure) -> None:
    file, hand = (played.folder / f"{name}.avatar").read_bytes(), avatars()[name][1]
    for said, light in (*LIGHTS.items(), ("placed", LIGHTS["lamp"])):
        found = played.image(f"{name}_{said}")
        used = apart(found, wanted(file, hand, light, PLACE if said == "placed" else STILL), light.shadow)
        measured(f"native, lit{' with a shadow' * light.shadow}, share of the tolerance", used, 1)
        assert used <= 1, said
        assert np.abs(found - played.image(f"{name}_unlit")).max() > 0.1, said
    shadowless = wanted(file, hand, replace(LIGHTS["sun"], shadow=False))
    assert apart(played.image(f"{name}_sun"), shadowless, True) > 1


def test_references_are_repeated(played: Job, measured: Measure) -> None:
    rows = [line[1:] for line in played.said if line[0] == "row" and line[2] in ("shadow", "light")]
    assert {row[1] for row in rows} == {"shadow", "light"}
    measured(
        "native, stages shadow and light, share of the tolerance", max(float(row[-2]) for row in rows), 1
    )
    assert ["passed", "1"] in played.said and ["passed", "0"] not in played.said


@pytest.mark.parametrize("name", avatars())
def test_without_a_light_nothing_of_it_is_left(played: Job, name: str) -> None:
    np.testing.assert_array_equal(played.image(f"{name}_off"), played.image(f"{name}_unlit"))


def test_lit_frames_allocate_nothing_and_a_lost_context_is_restored(played: Job) -> None:
    said = {line[0]: line[1:] for line in played.said}
    assert said["allocations"] == ["0"] and said["left"] == ["0"]
    np.testing.assert_array_equal(played.image("again"), played.image("full_sun"))
    np.testing.assert_array_equal(played.image("restored"), played.image("again"))
