"""What backend `gl` runs for a frame, dispatch by dispatch, in the form in which C# says it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends.gl import GlBackend
from avatar_runtime.backends.gl.programs import Dispatch
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.players.unity_play.desk import Played, Words

ROUNDINGS = 16  # Python rounds skin matrices to float32 before it skins anchors; C# computes in float64
ROUNDING = 2.0**-24
BLACK = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Ran:
    """One dispatch."""

    entry: str
    groups: int
    buffers: Mapping[str, str]
    constants: Mapping[str, Words]
    framed: Collection[str]  # constants that the frame gives


@dataclass(frozen=True)
class Frame:
    """Everything that is uploaded and run for a frame, and its image [H, W, 4]."""

    contents: Mapping[str, Words]
    sizes: Mapping[str, int]
    pose: Words
    runs: list[Ran]
    image: F32


def frame_of(avatar: Avatar, pose: Pose, camera: Camera, level: int = 0) -> Frame:
    """What backend `gl` does with an avatar from a pack."""
    player = Player(avatar, "gl", level=level, target="rgba32f")
    image = player.frame(pose, camera, BLACK).image
    backend = player.backend
    assert isinstance(backend, GlBackend)
    buffers = backend.interpreter.program.buffers
    with backend.gpu.current():
        pose_buffer = backend.interpreter._buffers.get("Pose")
        return Frame(
            {n: np.frombuffer(b.content(), np.uint32) for n, b in buffers.items() if b.sections},
            {name: buffer.size for name, buffer in buffers.items()},
            np.frombuffer(b"" if pose_buffer is None else pose_buffer.read(), np.uint32),
            list(_runs(backend)),
            np.dstack([image.colour, 1 - image.transmittance]),
        )


def _runs(backend: GlBackend) -> Iterator[Ran]:
    play, drawing = backend.interpreter, backend.scene.drawing
    lists = [play.mesh] if play.program.reads_mesh else []
    sort = drawing.sort
    names = {id(buffer): name for name, buffer in play._buffers.items()} | {id(sort.pairs): "Pairs"}
    for passes in (*lists, play.deforming, play.viewing):
        for _, _, step in passes._steps:
            yield _ran(backend, step.dispatch, step.sources, names)
    gathers = [kernel for _, kernels in drawing._pieces for kernel in kernels]
    for dispatch in (*sort._keys, *sort._steps, *gathers):
        yield _ran(backend, dispatch, (), names)


def _ran(backend: GlBackend, one: Dispatch, framed: Collection[str], names: dict[int, str]) -> Ran:
    entry = one.constants.entry
    table = backend.programs.table[entry]
    shader_names = {item["binding"]: item["name"] for item in table["storage"]}
    bound = {shader_names[binding]: buffer for buffer, binding in one._buffers}
    for name, buffer in bound.items():  # those of the scene: named when they first appear
        names.setdefault(id(buffer), name)
    constants = {}
    for member in table["uniform_blocks"][0]["members"]:
        words = 1 if member["type"] in ("uint", "float") else int(member["type"][-1])
        constants[member["name"]] = np.frombuffer(
            bytes(one.constants._bytes), np.uint32, words, member["offset"]
        )
    return Ran(entry, one._groups, {n: names[id(b)] for n, b in bound.items()}, constants, frozenset(framed))


def check_frame(played: Played, want: Frame, prefix: str = "0/") -> float:
    """Asserts that C# uploads and runs what backend `gl` does. Static contents, lists and literals are equal to the
    bit, what the pose and the camera give to some roundings of float32; returns the largest share of these.
    """
    sizes = {n.removeprefix(prefix): size for n, size in played.sizes.items() if n.startswith(prefix)}
    assert sizes == want.sizes
    contents = {name.removeprefix(prefix): words for name, words in played.contents.items()}
    assert contents.keys() == want.contents.keys()
    for name, words in want.contents.items():
        np.testing.assert_array_equal(contents[name], words, name)
    assert len(played.runs) == len(want.runs)
    used = [_share(played.writes.get(f"{prefix}Pose", want.pose[:0]), want.pose, "Pose")]
    for said, ran in zip(played.runs, want.runs, strict=True):
        bound = {name: buffer.removeprefix(prefix) for name, buffer in said["buffers"].items()}
        assert (said["entry"], said["groups"], bound) == (ran.entry, ran.groups, ran.buffers)
        assert said["constants"].keys() == ran.constants.keys()
        for name, wanted in ran.constants.items():
            what, given = f"{ran.entry} {name}", np.array(said["constants"][name], np.uint32)
            if name in ran.framed:
                used.append(_share(given, wanted, what))
            else:
                np.testing.assert_array_equal(given, wanted, what)
    return max(used)


def _share(got: Words, want: Words, what: str) -> float:
    a, b = got.view(np.float32).astype(np.float64), want.view(np.float32).astype(np.float64)
    assert a.shape == b.shape, what
    allowed = ROUNDINGS * ROUNDING * max(1.0, float(np.abs(b).max(initial=0.0)))
    share = float(np.abs(a - b).max(initial=0.0)) / allowed
    assert share <= 1, f"{what} uses {share} of its tolerance"
    return share
