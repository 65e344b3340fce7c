"""Runs Godot on a project: with a display of its own, or without one."""

from __future__ import annotations

import atexit
import functools
import os
import platform
import re
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest
from tools.godot.installed import REPOSITORY, Engine, Missing, find

ADD_ON = REPOSITORY / "players" / "godot"
FOLDER = "addons/gaussian_avatar"
SWITCHED_ON = f'[editor_plugins]\nenabled=PackedStringArray("res://{FOLDER}/plugin.cfg")\n'
RENDERERS = ("forward_plus", "mobile")
NOT_IN_A_GAME = shutil.ignore_patterns("extension", "*.windows.*", "*.macos.*", "*.arm64.*")
MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "aarch64": "arm64"}
PRESET = """[preset.0]
name="Linux"
platform="Linux"
runnable=true
export_filter="all_resources"
include_filter=""
exclude_filter=""
[preset.0.options]
binary_format/embed_pck=false
binary_format/architecture="{machine}"
texture_format/s3tc_bptc=true
custom_template/release="{template}"
"""
LIMIT_S = 240

# What a machine without a sound card or a window manager says, and the progress of the editor's first scan.
_NOISE = re.compile(r"ALSA lib|.*All audio drivers failed|.*Could not set V-Sync mode|\[ *\d+% \]|\[ DONE \]")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
_COMPLAINT = re.compile(r"\s*((USER |SCRIPT )?(ERROR|WARNING)):")
_LEAK = re.compile(r"leaked|still in use at exit")


@dataclass(frozen=True)
class Said:
    """How a run ended."""

    code: int
    text: str  # what it printed, without the noise of this machine
    cpu_s: float

    @property
    def complaints(self) -> list[str]:
        """Lines that begin with ERROR, SCRIPT ERROR, WARNING, ..."""
        return [line.strip() for line in self.text.splitlines() if _COMPLAINT.match(line)]

    @property
    def leaked(self) -> bool:
        """Whether the engine found something that was not freed."""
        return bool(_LEAK.search(self.text))

    def clean(self) -> Said:
        """Itself; the test fails if anything was complained about or leaked."""
        assert self.code == 0, f"exit code {self.code}\n{self.text[-3000:]}"
        assert not self.complaints and not self.leaked, self.text[-3000:]
        return self


@functools.cache
def engine() -> Engine:
    """The engine; a test without one is skipped, with the reason."""
    try:
        return find()
    except Missing as error:
        pytest.skip(f"Godot was not run: {error}")


def run(project: Path, *arguments: str, headless: bool = False, limit_s: float = LIMIT_S) -> Said:
    """Runs the editor's program on a project; a display is there unless `headless`."""
    shown = ("--headless",) if headless else ("--audio-driver", "Dummy")
    return start((*engine().editor, *shown, "--path", str(project), *arguments), headless, limit_s)


def run_by_itself(project: Path, *arguments: str) -> Said:
    """The same by a program that can start itself again, as the editor does to play a scene."""
    program, environment = _by_itself()
    return start(
        (program, "--audio-driver", "Dummy", "--path", str(project), *arguments), environment=environment
    )


@functools.cache
def _by_itself() -> tuple[str, dict[str, str]]:
    """A copy of the editor's program that names the fetched loader in place of the system's, and what it needs."""
    found = engine().editor
    if len(found) == 1:
        return found[0], {}
    folder = tempfile.TemporaryDirectory(
        prefix="gd", dir="/tmp"
    )  # its path must be shorter than the system's
    atexit.register(folder.cleanup)
    loader, program = Path(folder.name, "ld"), Path(folder.name, "godot")
    loader.symlink_to(found[0])
    data = Path(found[-1]).read_bytes()
    system = re.search(rb"/lib\w*/ld-linux[^\0]*\0", data)
    assert system is not None and len(str(loader)) < len(system[0])
    name = str(loader).encode().ljust(len(system[0]), b"\0")
    program.write_bytes(data[: system.start()] + name + data[system.end() :])
    program.chmod(0o755)
    return str(program), {"LD_LIBRARY_PATH": found[2]}


def start(
    command: tuple[str, ...],
    headless: bool = False,
    limit_s: float = LIMIT_S,
    environment: Mapping[str, str] | None = None,
) -> Said:
    """Runs a program of the engine, with a home of its own."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("XDG_", "DISPLAY", "WAYLAND"))
    }
    shown = {} if headless else {"DISPLAY": display()}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command,
        env={**kept, **engine().environment, **(environment or {}), **shown, "HOME": home()},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        timeout=limit_s,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Said(done.returncode, _without_noise(done.stdout), cpu_s)


def _without_noise(text: str) -> str:
    """A complaint goes with the line after it, which says where in the engine."""
    kept: list[str] = []
    noisy = False
    for line in map(str.rstrip, _COLOUR.sub("", text).splitlines()):
        place = line.lstrip().startswith("at: ")
        if place and not noisy and "audio_driver" in line:
            kept.pop()
        noisy = bool(_NOISE.match(line)) or (place and (noisy or "audio_driver" in line))
        if line and not noisy:
            kept.append(line)
    return "\n".join(kept)


@functools.cache
def home() -> str:
    """The home of this process's engines: settings, and caches that make the second start faster."""
    folder = tempfile.TemporaryDirectory(prefix="godot-home-")
    atexit.register(folder.cleanup)
    return folder.name


@functools.cache
def display() -> str:
    """A display that lives as long as this process, with the first free number."""
    found = engine()
    if not found.xvfb:
        pytest.skip("Godot was not run: Xvfb is missing")
    said, told = os.pipe()
    server = subprocess.Popen(
        [
            *found.xvfb,
            "-displayfd",
            str(told),
            "-screen",
            "0",
            "1280x1024x24",
            "-nolisten",
            "tcp",
            "-noreset",
        ],
        cwd=found.xvfb_folder,
        env={**os.environ, **found.environment},
        pass_fds=[told],
        stderr=subprocess.DEVNULL,
    )
    os.close(told)
    atexit.register(server.wait)
    atexit.register(server.terminate)
    with open(said) as number:
        name = f":{number.readline().strip()}"
    assert name != ":", "Xvfb did not start"
    return name


def project(folder: Path, renderer: str = "forward_plus", add_on: bool = True, settings: str = "") -> Path:
    """A project, with the add-on switched on; `settings` are further lines of project.godot."""
    folder.mkdir(parents=True, exist_ok=True)
    plugin = SWITCHED_ON if add_on else ""
    (folder / "project.godot").write_text(
        f'config_version=5\n[application]\nconfig/name="Test"\n{plugin}'
        f'[rendering]\nrenderer/rendering_method="{renderer}"\n{settings}'
    )
    if add_on:
        shutil.copytree(ADD_ON, folder / FOLDER, ignore=NOT_IN_A_GAME, dirs_exist_ok=True)
    return folder


def imported(folder: Path) -> Said:
    """The editor's first look at a project, as a build machine takes it."""
    return run(folder, "--import", headless=True)


def exported(folder: Path, out: Path) -> Callable[..., Said]:
    """Exports an imported project with the release template; gives what runs the game.

    The game's program is started by a copy of the loader that lies beside it and has the game's name: the engine looks
    for the game's data and libraries beside the program that the system started.
    """
    found = engine()
    if found.template is None:
        pytest.skip("Godot was not run: no export template (GODOT_TEMPLATE names one)")
    out.mkdir()
    machine = MACHINES.get(platform.machine())
    (folder / "export_presets.cfg").write_text(PRESET.format(machine=machine, template=found.template))
    run(folder, "--export-release", "Linux", str(out / "game.bin"), headless=True).clean()
    command: tuple[str, ...] = (str(out / "game.bin"),)
    if len(found.editor) > 1:
        loader = shutil.copy(found.editor[0], out / "game")
        command = (str(loader), *found.editor[1:-1], *command)

    def play(*arguments: str, headless: bool = False) -> Said:
        shown = ("--headless",) if headless else ("--audio-driver", "Dummy")
        return start((*command, *shown, *arguments), headless)

    return play
