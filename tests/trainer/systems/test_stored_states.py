"""States that somebody else wrote: what does not fit the subject is refused before a kernel trusts its indices."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.loop.resume import load_system
from avatar_trainer.systems.gaussian_blendshapes.system import create
from avatar_trainer.systems.protocol import System
from avatar_trainer.systems.psavatar import system as psavatar
from avatar_trainer.systems.splatting_avatar import system as splatting_avatar
from tests.trainer.systems.gaussian_blendshapes import subjects as blendshapes
from tests.trainer.systems.psavatar import scene as psavatar_scene
from tests.trainer.systems.splatting_avatar import scene

State = dict[str, Any]
NAN, INF = float("nan"), float("inf")


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Capture]:
    folder = tmp_path_factory.mktemp("captures")
    return {
        "gaussian_blendshapes": blendshapes.capture(folder),
        "splatting_avatar": scene.blank(folder / "s"),
        "psavatar": scene.blank(folder / "p"),
    }


def fresh(captures: dict[str, Capture], name: str) -> System:
    capture = captures[name]
    if name == "gaussian_blendshapes":
        return create(capture, blendshapes.settings(), 0)
    if name == "psavatar":
        return psavatar.create(capture, psavatar_scene.settings(), 0)
    return splatting_avatar.create(capture, scene.settings(init_colour="grey", sh_degree=1), 0)


def put(value: Any, *path: str, at: Any = None) -> Callable[[State], None]:
    """A change of a state: the value at `path`, or of the tensor there the entry `at`."""

    def change(state: State) -> None:
        for key in path[:-1]:
            state = state[key]
        if at is None:
            state[path[-1]] = value(state[path[-1]]) if callable(value) else value
        else:
            state[path[-1]] = state[path[-1]].clone()
            state[path[-1]][at] = value

    return change


def cut(values: torch.Tensor) -> torch.Tensor:
    return values[:-1]


def wide(values: torch.Tensor) -> torch.Tensor:
    return values.to(torch.float64 if values.dtype == torch.float32 else torch.int32)


def without(*path: str) -> Callable[[State], None]:
    def change(state: State) -> None:
        for key in path[:-1]:
            state = state[key]
        del state[path[-1]]

    return change


def fewer_rows(state: State) -> None:
    """One Gaussian less in the table alone."""
    for entry in state["table"].values():
        if len(entry["value"]) == 74:
            for part in ("value", "exp_avg", "exp_avg_sq"):
                entry[part] = cut(entry[part])


BLENDSHAPES = [
    (put(10**9, "rows", "init", "column", at=0), "init.column reaches"),
    (put(10**12, "rows", "init", "row_ptr", at=1), "init.row_ptr falls"),
    (put(cut, "rows", "learned", "column"), "learned.row_ptr does not lead"),
    (put(wide, "rows", "init", "column"), "init.column is torch.int32"),
    (put([0, 1], "rows", "init", "row_ptr"), "init.row_ptr is a list"),
    (put(None, "rows", "learned"), "NoneType"),
    (put(lambda group: group[:0], "rows", "group"), "group is torch.int64"),
    (put(lambda group: group.flip(0), "rows", "group"), "group falls"),
    (put(3, "rows", "group", at=-1), "group reaches from 0 to 3"),
    *((put(cut, "rows", name), f"{name} is") for name in ("skin_weights", "corrective", "mask")),
    (put(lambda values: values[:, :-1], "rows", "late"), "late is"),
    (put(NAN, "rows", "init_values", at=(0, 0)), "init_values has values that are not finite"),
    (fewer_rows, r"mean has 73 rows, not 74"),
    (put(2, "sh_degree"), "sh_degree is 2"),
    (put("6", "iteration"), "iteration is 6"),
    (put(10**9, "triangle", at=0), "triangle reaches"),
    (put(wide, "barycentric"), "barycentric is torch.float64"),
]
SPLATTING = [
    (put(128, "triangle", at=3), "triangle reaches from 0 to 128, not within 0..127"),
    (put(NAN, "barycentric", at=(0, 1)), "barycentric has values that are not finite"),
    (put(True, "sh_degree"), "sh_degree is True"),
    (put(-1, "crossings"), "crossings is -1"),
]
POINTS = [
    (put(128, "triangle", at=3), "triangle reaches from 0 to 128, not within 0..127"),
    (put(lambda values: values.long(), "off_mesh"), "off_mesh is torch.int64"),
    (put(cut, "visibility"), "visibility is"),
    (put(-1, "observed"), "observed is -1"),
    (put(1, "acquiring"), "acquiring and enhancing are not true or false"),
    (put(False, "acquiring"), "a table of .*log_scale.* cannot go on from one of"),
    (put(True, "enhancing"), "an enhancer, which these settings never train"),
    (put(lambda values: values[:, :-1], "table", "bases", "value"), "value of bases is"),
]
BOTH = [
    (put(cut, "density", "gradient_sum"), "gradient_sum is"),
    (put(NAN, "density", "gradient_sum", at=0), "gradient_sum has values that are not finite"),
    (without("density", "seen"), "seen"),
    (put(None, "density"), "NoneType"),
    (put(INF, "table", "opacity_logit", "exp_avg", at=0), "exp_avg of opacity_logit has values"),
    (put(-1.0, "table", "opacity_logit", "exp_avg_sq", at=0), "exp_avg_sq of opacity_logit .* below 0"),
    (put(NAN, "table", "opacity_logit", "step"), "step of opacity_logit"),
    (put([], "table"), "cannot go on"),
]
CASES = [
    *(("gaussian_blendshapes", *case) for case in [*BLENDSHAPES, *BOTH]),
    *(("splatting_avatar", *case) for case in [*SPLATTING, *BOTH]),
    *(("psavatar", *case) for case in POINTS),
]


@pytest.mark.parametrize(("name", "change", "said"), CASES, ids=[f"{n[0]} {s}" for n, _, s in CASES])
def test_a_state_that_does_not_fit_is_one_line(
    captures: dict[str, Capture], name: str, change: Callable[[State], None], said: str
) -> None:
    system = fresh(captures, name)
    state = copy.deepcopy(system.state())
    load_system(system, {"system": state})
    change(state)
    with pytest.raises(AvatarError, match=rf"^the checkpoint does not fit {name} on this capture \(.*{said}"):
        load_system(system, {"system": state})


@pytest.mark.parametrize("state", [{}, {"system": None}, {"system": []}, {"system": {"table": 3}}])
def test_a_state_that_is_none(captures: dict[str, Capture], state: State) -> None:
    for name in captures:
        with pytest.raises(AvatarError, match="does not fit"):
            load_system(fresh(captures, name), state)
