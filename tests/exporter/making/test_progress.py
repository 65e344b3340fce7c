"""The folder of `make`: what is continued, what is refused, what is made again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from avatar_export.making import child, progress, run
from avatar_export.making.options import SYSTEMS, Film, Wanted
from avatar_export.making.progress import FILE, Progress, alone, open_progress
from avatar_export.making.steps import Plan
from avatar_runtime.io.errors import AvatarError
from tests.session.kills import killed_before

ALL = ["capture", "check", "run", "bundle", "ada.avatar", "page"]
WORDS_AGAIN = ["capture", "bundle", "ada.avatar", "page"]  # and no training


@pytest.fixture
def plan(tmp_path: Path) -> Callable[..., Plan]:
    (tmp_path / "film.mp4").write_bytes(b"a film")

    def made(film: str = "film.mp4", size: int | None = None, **wanted: Any) -> Plan:
        return Plan(tmp_path / film, tmp_path / "ada", Film(size=size), Wanted(**wanted))

    return made


def finished(plan: Plan, done: list[str] = ALL) -> Progress:
    """A folder in which these steps have ended, with something in the place of what they write."""
    plan.out.mkdir(exist_ok=True)
    found = open_progress(plan, False)
    for step in found.plan.steps():
        if step.name in done:
            (plan.out / step.name).mkdir(exist_ok=True)
            found.end(step)
    return found


def left(found: Progress) -> list[str]:
    return [step.name for step in found.plan.steps() if not found.has(step)]


def test_what_is_left_out_is_as_before(plan: Callable[..., Plan]) -> None:
    finished(plan(size=128, iterations=7, consent="she agrees"))
    found = open_progress(plan(), False)
    assert left(found) == []
    assert (found.plan.film.size, found.plan.wanted.iterations, found.plan.wanted.seed) == (128, 7, 0)
    assert (found.plan.wanted.consent, found.plan.wanted.system) == ("she agrees", SYSTEMS[0])


def test_a_result_that_is_gone_is_made_again(plan: Callable[..., Plan]) -> None:
    (finished(plan()).plan.out / "page").rmdir()
    assert left(open_progress(plan(), False)) == ["page"]


REFUSED: dict[str, tuple[dict[str, Any], str, list[str]]] = {  # arguments, line, what --force makes again
    "a size": ({"size": 64}, "was made without --size; pass the same", ALL),
    "iterations": ({"iterations": 9}, "was made with --iterations 4000; pass the same", ALL[2:]),
    "two": ({"gaussians": 9, "seed": 1}, "without --gaussians and with another --seed;", ALL),
    "words": ({"license": "CC0"}, "was made with --licence CC BY 4.0;", WORDS_AGAIN),
    "a film": ({"film": "other.mp4"}, "was made of another film (film.mp4); name another folder", ALL),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_options_are_refused_and_forced(name: str, plan: Callable[..., Plan], tmp_path: Path) -> None:
    given, line, again = REFUSED[name]
    (tmp_path / "other.mp4").write_bytes(b"another film")
    out = finished(plan(license="CC BY 4.0")).plan.out
    before = (out / FILE).read_bytes()
    with pytest.raises(AvatarError) as refused:
        open_progress(plan(**given), False)
    assert line in str(refused.value) and (out / FILE).read_bytes() == before
    assert left(open_progress(plan(**given), True)) == again
    assert (out / "capture").exists() == (again != ALL) and (out / "run").exists() == ("run" not in again)


def test_each_option_belongs_to_one_step(plan: Callable[..., Plan]) -> None:
    steps = plan().filled({}).steps()
    assert sorted(flag for step in steps for flag in step.made_of) == sorted(plan().options())


def test_words_are_added_without_a_new_training(plan: Callable[..., Plan]) -> None:
    out = finished(plan()).plan.out
    assert left(open_progress(plan(consent="she agrees", license="CC0"), False)) == WORDS_AGAIN
    assert (out / "capture").exists() and (out / "run").exists()


def test_a_kill_at_any_change_of_the_disk_leaves_a_folder_that_goes_on(
    plan: Callable[..., Plan], tmp_path: Path
) -> None:
    (tmp_path / "other.mp4").write_bytes(b"another film")
    change, killed = 0, True
    while killed:
        finished(plan())
        given = plan("other.mp4", consent="she agrees")
        killed = killed_before(change, lambda given=given: open_progress(given, True))
        found = open_progress(given, True)
        assert left(found) == ALL and not (found.plan.out / "capture").exists()
        assert not list(found.plan.out.glob(".going"))
        (found.plan.out / FILE).unlink()
        for name in ALL:
            progress.remove(found.plan.out / name)
        change += 1
    assert change > 4


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "avatar-export-make"}', "\x00", "[" * 99999])
def test_a_make_json_of_something_else_is_refused(text: str, plan: Callable[..., Plan]) -> None:
    out = finished(plan()).plan.out
    (out / FILE).write_text(text)
    with pytest.raises(AvatarError, match=r"is not the make\.json"):
        open_progress(plan(), True)


def test_values_that_are_none_of_the_options_are_refused(plan: Callable[..., Plan]) -> None:
    out = finished(plan()).plan.out
    document = json.loads((out / FILE).read_text())
    (out / FILE).write_text(json.dumps(document | {"options": {"--seed": "x"}}))
    with pytest.raises(AvatarError, match=r"is not the make\.json"):
        open_progress(plan(), True)


def test_a_folder_of_something_else_is_refused(plan: Callable[..., Plan]) -> None:
    (plan().out / "mine").mkdir(parents=True)
    with pytest.raises(AvatarError, match="was not made by `make`; name another folder"):
        open_progress(plan(), True)


def test_one_at_a_time(plan: Callable[..., Plan], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    with (
        alone(plan().out),
        pytest.raises(AvatarError, match="another `make` works in it"),
        alone(plan().out),
    ):
        pass
    with alone(plan().out):
        pass


def test_a_step_ends_with_the_process_that_started_it(tmp_path: Path) -> None:
    """Here by SIGKILL, which nobody can catch: the pipe closes."""
    (tmp_path / "endless.py").write_text(
        "import os, pathlib, time\npathlib.Path('pid').write_text(str(os.getpid()))\ntime.sleep(600)\n"
    )
    start = f"""
import subprocess, sys
child = [sys.executable, "-m", {child.__name__!r}, "endless"]
subprocess.Popen(child, stdin=subprocess.PIPE).wait()
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    with subprocess.Popen([sys.executable, "-c", start], cwd=tmp_path, env=environment) as parent:
        number = int(soon(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text()))
        parent.send_signal(signal.SIGKILL)
    assert soon(
        lambda: (
            not Path(f"/proc/{number}/cmdline").exists() or not Path(f"/proc/{number}/cmdline").read_bytes()
        )
    )


def soon(found: Callable[[], Any]) -> Any:
    """What is found within half a minute."""
    until = time.monotonic() + 30
    while not (result := found()) and time.monotonic() < until:
        time.sleep(0.02)
    assert result
    return result


def test_a_missing_library_is_named_before_anything_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(run.NEEDED, "no_such_library", "mediapipe")
    with pytest.raises(AvatarError, match=r'needs mediapipe: pip install -e ".*\[video\]"$'):
        run.expect_libraries()
