"""Jobs for project/desk.gd: what a project in Godot does, and the pictures that it gives."""

from __future__ import annotations

import atexit
import functools
import json
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.pose import Pose, resolve
from tests.players.godot.engine import FOLDER, imported, project, run

DESK = Path(__file__).parent / "project" / "desk.gd"
STILL = np.eye(4)
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # Godot's cameras look along -z, with y up


@dataclass
class Job:
    """Commands of project/desk.gd, and what came of them."""

    folder: Path
    renderer: str = "forward_plus"
    options: Sequence[str] = ()  # of the engine
    complaints: Sequence[str] = ()  # of an engine with such options, of itself
    commands: list[list[Any]] = field(default_factory=list)
    answers: dict[str, Any] = field(default_factory=dict)

    def say(self, *command: Any) -> None:
        """A command as it is."""
        self.commands.append(list(command))

    def avatar(self, name: str, pack: Path, place: F64 = STILL) -> None:
        """A node with a pack."""
        self.say("avatar", name, str(pack), numbers(place))

    def pose(self, name: str, avatar: Avatar, pose: Pose) -> None:
        """Poses a node."""
        self.say("pose", *posed(name, avatar, pose))

    def camera(self, seen: Camera, command: str = "look", *words: str, place: F64 = STILL) -> None:
        """The camera of all that follows, moved by a place; its axis goes through the middle of the image."""
        fov = float(np.degrees(2 * np.arctan(seen.tan_half_fov_y)))
        self.say(command, *words, numbers(place @ eye(seen)), fov, seen.width, seen.height)

    def seen(self, name: str, place: F64 = STILL) -> Camera:
        """The camera of a picture, as Godot has it: it rounds what it is told. Relative to a place."""
        columns = [np.array(column) for column in self.answers[f"camera {name}"]]
        turn, at, lens = np.stack(columns[:3]), columns[3] - place[:3, 3], np.stack(columns[4:], axis=1)
        view = np.eye(4)
        view[:3] = np.column_stack([turn, -turn @ at])
        width, height, _ = self.answers[f"viewport {name}"]
        return Camera.from_opengl(view, lens, int(width), int(height))

    def accumulated(self, name: str) -> F32:
        """[H, W, 4] premultiplied, display-referred colour and alpha."""
        width, height = map(int, self.answers[f"accumulated {name}"])
        return np.fromfile(self.folder / f"{name}.accumulated", np.float32).reshape(height, width, 4)

    def viewport(self, name: str) -> F64:
        """[H, W, 3] of what people see: display-referred, or linear light of a viewport with use_hdr_2d."""
        width, height, is_linear = map(int, self.answers[f"viewport {name}"])
        data = np.fromfile(self.folder / f"{name}.viewport", np.float32 if is_linear else np.uint8)
        shown = data.reshape(height, width, 4)[..., :3].astype(np.float64)
        return shown if is_linear else shown / 255

    def play(self, binary: Path | None = None) -> Job:
        """Starts the engine once, with another binary where one is named. It must end well."""
        told = self.folder / "job.json"
        told.write_text(json.dumps(self.commands))
        where = prepared()
        if binary is not None:
            where = Path(shutil.copytree(where, self.folder / "project"))
            shutil.copy(binary, where / FOLDER / "bin")
        method = ("--rendering-method", self.renderer, *self.options)
        said = run(where, *method, "--script", "res://desk.gd", "--", str(told))
        assert said.code == 0 and not {*said.complaints} - {*self.complaints}, said.text[-3000:]
        assert self.complaints or not said.leaked, said.text[-3000:]
        self.answers = json.loads((self.folder / "answers.json").read_text())
        return self


@functools.cache
def prepared() -> Path:
    """A project with the add-on and project/desk.gd, as the editor has imported it: one for all jobs of a process."""
    held = tempfile.TemporaryDirectory(prefix="godot-desk-")
    atexit.register(held.cleanup)
    folder = project(Path(held.name))
    shutil.copy(DESK, folder)
    imported(folder).clean()
    return folder


def posed(name: str, avatar: Avatar, pose: Pose) -> list[Any]:
    """The words of a pose."""
    arrays = resolve(pose, avatar)
    weights, late = arrays.expression_weights.tolist(), arrays.late_weights.tolist()
    return [name, weights, late, [*map(numbers, arrays.joint_delta)], numbers(arrays.world_from_avatar)]


def eye(seen: Camera) -> F64:
    """[4, 4] world from Godot's camera."""
    matrix: F64 = np.linalg.inv(seen.camera_from_world.astype(np.float64)) @ FLIP
    return matrix


def numbers(matrix: Any) -> list[float]:
    """The first three rows."""
    return np.asarray(matrix, np.float64)[:3].ravel().tolist()
