"""rig.glb by Godot's own importer: vertices, shapes, bones and clips; its page's fragments."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.engine_pose import engine_pose, target_names
from tests.asm_faces import asm_avatar
from tests.avatars import full_avatar
from tests.docs.test_engine_pages_run import fragments
from tests.interop import test_rig_clients as clients
from tests.interop.clients import ROOT_NODE, Answer, job_pose, oracle_state
from tests.interop.rigs import RigFile, clip_frames, random_poses, rig_file, with_odd_names
from tests.interop.test_rig_clients import Asked
from tests.measured import Measure
from tests.oracles.gltf_pose import File, State
from tests.players.godot import engine

Array = npt.NDArray[Any]

pytestmark = pytest.mark.godot

HERE = Path(__file__).parent
HEAD = HERE.parents[2] / "samples" / "trained" / "head_blendshapes"
RIGS = ("full/4", "full/8", "odd_names/4", "asm/4", "body/4", "head/4")
DEFAULTS = "defaults/4"  # the head as Godot imports it unless told otherwise


class Stored(File):
    """A .glb as Godot keeps it: weights cut to 16 bits. What they lack of 1 stays where it is before the skin when the
    engine bakes a mesh.
    """

    def attribute(self, name: str) -> Array:
        found: Array = super().attribute(name)
        return np.floor(65535 * found) / 65535 if name.startswith("WEIGHTS") else found

    def posed(self, state: State, sets: int = 1) -> Array:
        lack = 1 - sum(self.attribute(f"WEIGHTS_{k}").sum(axis=1, keepdims=True) for k in range(sets))
        names = [node["name"] for node in self.json["nodes"]]
        world = self.world_matrices(state)[names.index(ROOT_NODE)]
        return super().posed(state, sets) + lack * (self.shaped(state) @ world[:3, :3].T + world[:3, 3])


@pytest.fixture(scope="module")
def answers(body_avatar: Avatar, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Asked]:
    """What one run of the engine says of all rigs, vertices in the order of the file."""
    full, head = full_avatar(), load(HEAD)
    avatars = {"full": full, "odd_names": with_odd_names(full), "asm": asm_avatar(), "body": body_avatar}
    avatars |= {"head": head, "defaults": head}
    project = engine.project(tmp_path_factory.mktemp("project"), add_on=False)
    given, jobs = {}, {}
    for rig in (*RIGS, DEFAULTS):
        name, influences = rig.split("/")
        folder = project / rig
        folder.mkdir(parents=True)
        made = rig_file(avatars[name], int(influences), folder)
        given[rig] = replace(made, file=Stored(made.path.read_bytes()))
        if rig != DEFAULTS:
            rate = math.lcm(*(int(clip.fps) for clip in made.avatar.clips))
            settings = fragments("godot", "ini").replace("fps=30\n", f"fps={rate}\n")
            (folder / "rig.glb.import").write_text(settings, "utf-8")
        jobs[f"{rig}/rig.glb"] = job(given[rig], rig in ("head/4", DEFAULTS))
    (project / "job.json").write_text(json.dumps(jobs), "utf-8")
    script = (HERE / "rig.gd").read_text("utf-8") + "\n\n" + fragments("godot", "gdscript")
    (project / "rig.gd").write_text(script, "utf-8")
    engine.imported(project).clean()
    engine.run(project, "--script", "res://rig.gd").clean()
    said = json.loads((project / "answer.json").read_text("utf-8"))
    return {rig: asked(given[rig], said[f"{rig}/rig.glb"], jobs[f"{rig}/rig.glb"]) for rig in given}


def job(given: RigFile, every_frame: bool) -> dict[str, Any]:
    """What rig.gd is asked about a rig: poses, and times of its clips."""
    avatar = given.avatar
    poses = (*random_poses(avatar), *residual_poses(avatar))
    clips = [(c, c.name, clip_frames(c)) for c in avatar.clips]
    clips += [(c, f"every {c.name}", list(range(c.frames))) for c in avatar.clips if every_frame]
    return {
        "poses": [job_pose(avatar, engine_pose(avatar, pose)) for pose in poses],
        "clips": [{"clip": c.name, "name": name, "times": [k / c.fps for k in at]} for c, name, at in clips],
    }


def asked(given: RigFile, facts: dict[str, Any], job: dict[str, Any]) -> Asked:
    """An answer as other clients give it."""
    by_id = {int(row): vertices for row, vertices in facts["ids"].items()}
    rows = np.array(sorted(by_id))
    order = np.array([by_id[row] for row in rows]).ravel()  # one vertex an id, or this is no permutation
    names = [f"pose/{k}" for k in range(len(job["poses"]))]
    names += [f"clip/{clip['name']}/{k}" for clip in job["clips"] for k in range(len(clip["times"]))]
    posed = np.fromfile(given.path.with_name("rig.glb.f32"), "<f4").reshape(len(names), -1, 3)
    assert sorted(order) == list(range(posed.shape[1]))
    arrays = dict(zip(names, posed[:, order], strict=True))
    for name, width in (("position", 3), ("uv", 2)):
        array = np.frombuffer(bytes.fromhex(facts.pop(name)), "<f4").reshape(-1, width)
        arrays[f"attribute/{name}"] = array[order]
    arrays["attribute/_vertex_id"] = rows
    arrays["triangles"] = np.argsort(order)[np.reshape(facts.pop("triangles"), (-1, 3)).astype(int)]
    facts |= {"vertices": len(rows), "targets": facts.pop("shapes")}
    return Asked("godot", given, Answer(facts, arrays))


@pytest.fixture(params=RIGS, name="asked")
def each(request: pytest.FixtureRequest, answers: Mapping[str, Asked]) -> Asked:
    return answers[request.param]


test_vertex_ids_arrive_and_name_the_vertices = clients.test_vertex_ids_arrive_and_name_the_vertices
test_posed_vertices = clients.test_posed_vertices
test_clips_play = clients.test_clips_play


def test_names_arrive(asked: Asked) -> None:
    facts, avatar = asked.answer.facts, asked.given.avatar
    names = [name.translate({ord(letter): "_" for letter in ":/"}) for name in asked.given.rig.joint_names]
    assert sorted(facts["joints"]) == sorted(names)
    assert facts["targets"] == list(target_names(avatar))
    assert facts["clips"] == sorted(clip.name for clip in avatar.clips)
    assert facts["influences"] == asked.given.influences


def test_the_sample_head_arrives_whole(answers: Mapping[str, Asked]) -> None:
    facts = answers["head/4"].answer.facts
    assert (facts["vertices"], len(facts["targets"]), len(facts["joints"])) == (6000, 89, 5)
    assert facts["clips"] == ["held_out", "random", "training"]


def test_corners_are_turned(asked: Asked) -> None:
    """The same triangles in another order, corners (0, 2, 1): front faces are clockwise."""
    rows = asked.vertex_ids()[asked.answer.arrays["triangles"]]
    shown, triangles = (
        {first_least(t) for t in some.tolist()} for some in (rows[:, [0, 2, 1]], asked.given.rig.triangles)
    )
    assert shown <= triangles and len(shown) == len(rows)


def first_least(triangle: list[int]) -> tuple[int, ...]:
    """The same triangle from its least corner on."""
    at = triangle.index(min(triangle))
    return (*triangle[at:], *triangle[:at])


def test_what_else_the_page_says(asked: Asked) -> None:
    facts, file = asked.answer.facts, asked.given.file
    assert facts["root"] == "Node3D" and facts["mode"] == 0, "avatar_root; NORMALIZED"
    assert facts["coloured"], "the material takes vertex colours, which are linear"
    assert asked.answer.rows("attribute/uv", 2)[:, 1].min() >= 2, "v is not flipped"
    each = np.array(
        [file.shaped(State(weights={name: 1.0})) for name in file.target_names]
        + [file.shaped(State(weights={}))]
    )
    bounds = [each.min(axis=(0, 1)), each.max(axis=(0, 1))]
    np.testing.assert_allclose(facts["bounds"], bounds, rtol=0, atol=1e-6 * asked.given.height)


def test_clips_of_the_sample_head(answers: Mapping[str, Asked], measured: Measure) -> None:
    """At every key: imported as the page asks for it, and by Godot's defaults, which drop keys."""
    avatar, file = answers[DEFAULTS].given.avatar, File(answers[DEFAULTS].given.path.read_bytes())
    for clip in load(HEAD).clips:
        poses = [engine_pose(avatar, frame_pose(avatar, clip, k)) for k in range(clip.frames)]
        expected = [file.posed(oracle_state(avatar, pose)) for pose in poses]
        all_keys = keys(file, clip.name)
        for rig, limit in (("head/4", clients.TOLERANCE), (DEFAULTS, None)):
            errors = [answers[rig].worst(f"clip/every {clip.name}/{k}", p) for k, p in enumerate(expected)]
            worst, kept = max(errors), answers[rig].answer.facts["keys"][clip.name]
            how = f"clip {clip.name} of the head's rig.glb in Godot, {'defaults' if limit is None else 'optimiser off'}"
            measured(f"{how}, parts of height", worst, limit)
            if limit is None:
                measured(f"{how}, share of keys kept", kept / all_keys)
                measured(
                    f"{how}, frames off by 5e-4 of height or more", sum(error >= 5e-4 for error in errors)
                )
            assert (kept < 0.5 * all_keys and worst > 1e-4) if limit is None else worst <= limit


def keys(file: File, clip: str) -> int:
    """How many keys the file has for a clip: one a time and node, one a time and shape."""
    (animation,) = (each for each in file.json["animations"] if each["name"] == clip)
    times = [
        (c["target"]["path"], animation["samplers"][c["sampler"]]["input"]) for c in animation["channels"]
    ]
    return sum(
        len(file.accessor(at)) * (len(file.target_names) if path == "weights" else 1) for path, at in times
    )
