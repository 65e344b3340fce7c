"""Asks the web player in a browser: packs go in, images and verdicts come out."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.pose import Pose, resolve
from tests.session.needed import need

WEB = Path(__file__).parents[2] / "players" / "web"
CHROMIUM = "chromium"
SHELL = "chromium-headless-shell"  # which shows on a page what WebGPU draws
PROGRAMS = {
    CHROMIUM: ("chromium", "chromium-browser", "google-chrome"),
    "firefox": ("firefox-esr", "firefox"),
    "webkit": ("WebKitWebDriver",),
}
BACKENDS = {CHROMIUM: ("webgpu", "webgl2"), "firefox": ("webgl2",), "webkit": ("webgl2",)}
OTHERS = tuple(name for name in PROGRAMS if name != CHROMIUM)
LIMIT_S = 600
# `make test` plays in Chromium, `make players` in all.
in_browsers = pytest.mark.parametrize(
    "browser", [CHROMIUM, *(pytest.param(name, marks=pytest.mark.players) for name in OTHERS)]
)


@dataclass
class Job:
    """What the page plays. `files` are served, by their address."""

    backends: Sequence[str]
    files: dict[str, str] = field(default_factory=dict)
    shots: list[dict[str, Any]] = field(default_factory=list)
    references: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Answer:
    """Images by (backend, shot): premultiplied colour and alpha [H, W, 4]; reports by (backend, reference)."""

    images: Mapping[tuple[str, str], F32]
    reports: Mapping[tuple[str, str], Mapping[str, Any]]


def node() -> str:
    """Node.js, with the packages that the web player is built with. See `need`."""
    found = shutil.which("node")
    need({"Node.js 18 or newer": found, "players/web/node_modules (npm ci)": (WEB / "node_modules").exists()})
    return str(found)


def environment_of(browser: str) -> dict[str, str]:
    """What makes the tests in Node take a browser, which is there. See `need`."""
    found = next(filter(None, map(shutil.which, PROGRAMS[browser])), None)
    if browser == CHROMIUM:
        found = os.environ.get("CHROMIUM") or found
    else:
        need({"Xvfb": shutil.which("Xvfb")})
    need({browser: found})
    return {**os.environ, "AVATAR_BROWSER": browser}


def run_node_test(file: str, environment: Mapping[str, str] = os.environ, **more: str) -> str:
    """What `node --test FILE` of players/web/tests prints. Fails the test with what failed there."""
    done = subprocess.run(
        [node(), "--test", "--test-reporter", "tap", f"tests/{file}"],
        cwd=WEB,
        env={**environment, **more},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    failed = done.stdout[max(done.stdout.find("\nnot ok"), 0) :]
    assert done.returncode == 0, failed[:3000] + done.stderr[-2000:]
    assert "\n# pass 0\n" not in done.stdout, "no test ran"
    return done.stdout


def ask(job: Job, folder: Path, browser: str) -> Answer:
    """Runs a job; `folder` takes its files. Fails the test with what the page or the browser says."""
    environment = environment_of(browser)
    told = folder / "job.json"
    told.write_text(json.dumps(vars(job)))
    out = folder / "out"
    out.mkdir()
    command = [node(), str(WEB / "tests" / "run.mjs"), str(told), str(out)]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
    answer = json.loads((out / "report.json").read_text()) if (out / "report.json").exists() else {}
    assert done.returncode == 0, f"{answer.get('errors')} {done.stderr[-2000:]}"
    images = {}
    for shot in job.shots:
        size = shot["camera"]["height"], shot["camera"]["width"], 4
        for backend in job.backends:
            raw = np.fromfile(out / backend / f"{shot['name']}.f32", np.float32)
            images[backend, shot["name"]] = raw.reshape(size)
    reports = {(b, name): report for b, by in answer["conform"].items() for name, report in by.items()}
    return Answer(images, reports)


def shot(
    name: str,
    avatars: Sequence[tuple[str, Avatar, Pose]],
    seen: Camera,
    level: int = 0,
    light: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """A shot of avatars, each with the address of its pack and its pose; `light`: as SPEC.md, section 19, has it."""
    posed = [_posed(*one, level) for one in avatars]
    return {"name": name, "avatars": posed, "camera": camera_json(seen), "light": light}


def camera_json(seen: Camera) -> dict[str, Any]:
    """A camera as the page takes it."""
    return {
        "cameraFromWorld": seen.camera_from_world.ravel().tolist(),
        "clipFromWorld": seen.clip_from_world.ravel().tolist(),
        "centre": seen.centre.tolist(),
        "tanHalfFovX": seen.tan_half_fov_x,
        "tanHalfFovY": seen.tan_half_fov_y,
        "width": seen.width,
        "height": seen.height,
    }


def _posed(address: str, avatar: Avatar, pose: Pose, level: int) -> dict[str, Any]:
    arrays = resolve(pose, avatar)
    posed = {
        "expressionWeights": arrays.expression_weights.tolist(),
        "lateWeights": arrays.late_weights.tolist(),
        "jointDelta": arrays.joint_delta.ravel().tolist(),
        "worldFromAvatar": arrays.world_from_avatar.ravel().tolist(),
    }
    return {"file": address, "pose": posed, "level": level}
