"""The GPU of the Unity player's core: a C# program says what to upload, to run, to draw; backend `gl`'s parts do it.

Nothing here knows a stage, a pass or a constant: buffers, dispatches and sizes are what C# says.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import moderngl
import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl.draw import FLIP_Y, ORDERS
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.programs import Dispatch, Programs
from avatar_runtime.backends.gl.state import drawing_into
from avatar_runtime.backends.gl.target import Target
from avatar_runtime.program.chunks import BUFFER_LIMIT
from tests.players.unity import compile_csharp, core_sources, need_mono, sources
from tests.session.shared_folder import made_once

PLAY = Path(__file__).parent
Words = npt.NDArray[np.uint32]


@dataclass
class Played:
    """What C# said of one scene or reference, and its image [H, W, 4]: premultiplied colour and alpha."""

    runs: list[dict[str, Any]] = field(default_factory=list)
    rows: list[dict[str, Any]] = field(default_factory=list)  # verdicts
    image: F32 | None = None


class Desk:
    """Serves one C# program."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu, self._programs = gpu, Programs(gpu)
        self._buffers: dict[str, moderngl.Buffer] = {}
        self._draw = self._programs.draw("raster_vertex", "raster_pixel")
        self._inputs = [item["name"] for item in self._programs.table["raster_vertex"]["inputs"]]
        self.played: dict[str, Played] = {}
        self._now = Played()

    def serve(self, ask: IO[bytes], answer: IO[bytes]) -> None:
        """Does what is asked until the other end is gone."""
        for line in ask:
            said = json.loads(line)
            words = (
                np.frombuffer(ask.read(4 * said.get("words", 0)), np.uint32) if said["do"] in TAKES else NONE
            )
            found = getattr(self, said["do"])(said, words)
            if found is not None:
                answer.write(found.tobytes())
                answer.flush()

    def begin(self, said: Mapping[str, Any], _: Words) -> None:
        """Another scene or reference."""
        for buffer in self._buffers.values():
            self._gpu.drop(buffer)
        self._buffers.clear()
        self._now = self.played.setdefault(said["name"], Played())

    def make(self, said: Mapping[str, Any], words: Words) -> None:
        """A buffer, with words or with zeros."""
        content = words if len(words) else np.zeros(-(-said["bytes"] // 4), np.uint32)
        self._buffers[said["name"]] = self._gpu.buffer(said["name"], content)

    def write(self, said: Mapping[str, Any], words: Words) -> None:
        """Words into a buffer."""
        self._buffers[said["name"]].write(words.tobytes())

    def read(self, said: Mapping[str, Any], _: Words) -> Words:
        """Words of a buffer."""
        return np.frombuffer(self._buffers[said["name"]].read(4 * said["words"]), np.uint32)

    def run(self, said: Mapping[str, Any], _: Words) -> None:
        """One dispatch."""
        self._now.runs.append(dict(said))
        self._dispatch(said).run()
        self._gpu.context.memory_barrier()

    def _dispatch(self, said: Mapping[str, Any]) -> Dispatch:
        buffers = {name: self._buffers[buffer] for name, buffer in said["buffers"].items()}
        members = self._programs.table[said["entry"]]["uniform_blocks"][0]["members"]
        types = {member["name"]: member["type"] for member in members}
        assert said["constants"].keys() == types.keys(), said["entry"]
        bits = {name: np.array(words, np.uint32) for name, words in said["constants"].items()}
        values = {n: b.view(np.float32) if types[n].startswith("float") else b for n, b in bits.items()}
        return self._programs.dispatch(said["entry"], said["groups"], buffers, values, 1)

    def draw(self, said: Mapping[str, Any], _: Words) -> F32:
        """The quads in a float image, each over what is there."""
        size = said["width"], said["height"]
        target, context = Target(self._gpu, size, "rgba32f"), self._gpu.context
        target.clear(None)
        constants = self._programs.constants("raster_vertex", {"image_size": size, "flip_y": FLIP_Y})
        quads = context.vertex_array(self._draw, [(self._buffers["Quads"], "4f 4f 4f/i", *self._inputs)])
        with drawing_into(context, target.framebuffer, moderngl.BLEND):
            context.blend_func = ORDERS["back_to_front"]
            context.blend_equation = moderngl.FUNC_ADD, moderngl.FUNC_ADD
            constants.bind()
            quads.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=said["quads"])
        self._now.image = target.read()
        quads.release()
        target.release()
        return self._now.image

    def report(self, said: Mapping[str, Any], _: Words) -> None:
        """Verdicts of a reference."""
        self.played[said["name"]].rows += said["rows"]


TAKES = ("make", "write")  # what has words behind its line
NONE = np.zeros(0, np.uint32)


def player_program(factory: pytest.TempPathFactory) -> Path:
    """The program of tests/players/unity_play with the core. It is compiled once for all workers."""
    need_mono()

    def make(folder: Path) -> Path:
        return compile_csharp([*core_sources(), *sources(PLAY)], folder / "play.exe")

    return made_once(factory, "unity_play", make)


def play(program: Path, job: Mapping[str, Any], folder: Path) -> dict[str, Played]:
    """Scenes by their names and references by their folders, played by one process."""
    told = folder / "job.json"
    told.write_text(json.dumps(job))
    gpu = Gpu(None, False, BUFFER_LIMIT)
    try:
        with gpu.current():
            desk = Desk(gpu)
            command = ["mono", str(program), str(told)]
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
                assert process.stdin is not None and process.stdout is not None
                desk.serve(process.stdout, process.stdin)
            assert process.returncode == 0
            return desk.played
    finally:
        gpu.release()
