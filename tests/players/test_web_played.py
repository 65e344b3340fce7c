"""The web player against the runtime: every stage against the vectors, every image against backend `gl`."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from avatar_runtime.avatar import F32
from tests.measured import Measure
from tests.players.played_cases import HEAD, folder_name, image_of, played_cases
from tests.players.web import BACKENDS, CHROMIUM, SHELL, Answer, Job, ask, in_browsers, run_node_test, shot
from tests.runtime.backends import gl_cases
from tests.session.needed import need

IMAGE_LIMIT = 1 / 255


def address(name: str) -> str:
    return "/" + folder_name(name)


@in_browsers
def test_all_stages_and_images_of_all_avatars(
    browser: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, measured: Measure
) -> None:
    """One test, because it takes one browser: stages within the kit's tolerances, images as backend `gl` draws them."""
    job, expected = Job(BACKENDS[browser]), {}
    for name, case in played_cases(tmp_path_factory).items():
        for part in case.folder.iterdir():
            job.files[f"{address(name)}/{part.name}"] = str(part)
        job.references.append(address(name))
        posed = [(f"{address(name)}/{HEAD}", case.avatar, gl_cases.pose_of(case.avatar))]
        job.shots.append(shot(address(name)[1:], posed, gl_cases.camera()))
        expected[address(name)[1:]] = image_of(case.avatar)
    answer = ask(job, tmp_path, browser)
    for backend in job.backends:
        assert not wrong_stages(answer, backend, measured, browser)
        assert not wrong_images(answer, backend, expected, measured, browser)


def test_a_page_shows_what_webgpu_draws() -> None:
    need({SHELL: shutil.which(SHELL)})
    run_node_test("shown.test.mjs")


def named(browser: str, backend: str) -> str:
    """What measurements call a backend of a browser."""
    return f"web {backend}" if browser == CHROMIUM else f"web {backend}, {browser}"


def wrong_stages(answer: Answer, backend: str, measured: Measure, browser: str) -> list[str]:
    """Outputs beyond their tolerance."""
    rows = [
        (name, r) for (kind, name), said in answer.reports.items() if kind == backend for r in said["rows"]
    ]
    assert all(said["rows"] for said in answer.reports.values())
    measured(
        f"{named(browser, backend)}, stages, share of the tolerance", max(row["used"] for _, row in rows), 1
    )
    return [f"{name}: {r['case']}/{r['stage']}/{r['output']}" for name, r in rows if not r["passed"]]


def wrong_images(
    answer: Answer, backend: str, expected: Mapping[str, F32], measured: Measure, browser: str
) -> dict[str, float]:
    """Images too far from those of `gl`."""
    images = {name: answer.images[backend, name] for name in expected}
    assert all(image[..., 3].max() > 0.5 for image in images.values())
    apart = {name: float(np.abs(images[name] - want).max()) for name, want in expected.items()}
    measured(f"{named(browser, backend)}, image", max(apart.values()), IMAGE_LIMIT)
    return {name: value for name, value in apart.items() if value > IMAGE_LIMIT}
