"""`avatar-export make`: bad input, and a film that becomes an avatar although the process is killed in between."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from avatar_runtime.bundle import load
from avatar_runtime.packs import decode_pack
from tests.commands import Refused, Run
from tests.pages import Page

BAD: dict[str, tuple[tuple[str, ...], str]] = {
    "no film": (("nowhere.mp4",), "nowhere.mp4: no such file"),
    "a folder": (("{}",), "is not a file; pass the film"),
    "no project": (("{}/film.mp4", "--into", "{}/nowhere"), "nowhere"),
}
WRONG: dict[str, tuple[tuple[str, ...], str]] = {
    "two lenses": (("--focal", "900", "--fov", "60"), "--focal and --fov cannot be used together"),
    "an unknown system": (
        ("--system", "nerf"),
        "not one of gaussian_blendshapes, splatting_avatar, psavatar",
    ),
    "a rotation": (("--rotation", "45"), "not one of 0, 90, 180, 270"),
    "a second": (("--first", "-1"), "'--first'"),
    "no iterations": (("--iterations", "0"), "'--iterations'"),
}


@pytest.fixture
def film(tmp_path: Path) -> Path:
    (tmp_path / "film.mp4").write_bytes(b"no film")
    return tmp_path / "film.mp4"


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_before_anything_is_done(name: str, refused: Refused, film: Path) -> None:
    given, line = BAD[name]
    out = film.parent / "me"
    assert line in refused("make", *(one.format(film.parent) for one in given), "-o", out)
    assert not out.exists()


@pytest.mark.parametrize("name", WRONG)
def test_wrong_options(name: str, run: Run, film: Path) -> None:
    given, line = WRONG[name]
    code, _, error = run("make", film, "-o", film.parent / "me", *given)
    assert code == 2 and line in " ".join(error.replace("│", " ").split())
    assert not (film.parent / "me").exists()


WORDS = {"consent": "she is computed, and agrees", "licence": "CC0"}
STEPS = ("capture", "check", "run", "bundle", "ada.avatar", "page", "drop")
SMALL = ("--name", "Ada", "--size", "96", "--iterations", "4", "--gaussians", "200")
SAID = [word for name, text in WORDS.items() for word in (f"--{name}", text)]


def made(film: Path, out: Path, *options: str, until: str = "") -> list[str]:
    """The lines of a run; it is killed as soon as one begins as `until` says. Without that it must succeed."""
    command = [sys.executable, "-m", "avatar_export", "make", film, "-o", out, *options]
    lines = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line.rstrip())
            if until and line.startswith(until) and not line.endswith("done before\n"):
                process.kill()
                break
        process.stdout.read()
    assert until or process.returncode == 0, lines
    return lines


@pytest.mark.more
def test_a_film_becomes_an_avatar_although_each_step_is_killed_once(tmp_path: Path) -> None:
    from samples.films.render import scene
    from samples.films.table import film
    from samples.films.write import write_film

    video, web = write_film(scene(film("anna"), 1.0, 160), tmp_path), tmp_path / "web"
    web.mkdir()
    (web / "index.html").write_text("<html></html>")
    out, into = tmp_path / "me", ("--into", str(web), *SMALL, *SAID)
    for number, name in enumerate(STEPS, 1):
        lines = made(video, out, *into, until=f"{number} of 7")
        done = [line.split()[3] for line in lines if line.endswith(": done before")]
        assert done == [f"{one}:" for one in STEPS[: max(number - 2, 0)]] and f"  {name}: " in lines[-1]
    assert made(video, out, *into)[5].endswith("page: done before")

    whole = tmp_path / "whole"
    made(video, whole, *SMALL)
    assert "not stated" in str(load(whole / "bundle").provenance["licence"])
    assert [line.split()[3] for line in made(video, whole, *SAID) if line.endswith("done before")] == [
        "check:",
        "run:",
    ]
    same = [(folder / "ada.avatar").read_bytes() for folder in (out, whole)]
    assert same[0] == same[1], "as without a kill, and with the words from the first"
    assert not [path for path in out.iterdir() if path.name.startswith(".")]
    assert {path.name for path in out.iterdir()} == {*STEPS[:-1], "make.json"}
    pack = decode_pack((out / "ada.avatar").read_bytes(), "ada.avatar")
    for said in (load(out / "bundle").provenance, json.loads((out / "capture" / "capture.json").read_text())):
        assert (said["consent"], said["licence"].partition("; head mesh")[0]) == tuple(WORDS.values())
    assert (pack.avatar.name, [clip.name for clip in pack.avatar.clips]) == ("Ada", ["film"])
    assert pack.avatar.driving is not None and "joint/jaw/x" in pack.avatar.driving.outputs
    for page in (out / "page" / "index.html", web / "ada" / "index.html"):
        [text] = [text for text in Page(page.read_text()).text["script"] if text.startswith("{")]
        [shown] = json.loads(text)["avatars"]
        assert (shown["consent"], shown["license"].partition("; head mesh")[0]) == tuple(WORDS.values())
