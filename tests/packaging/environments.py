"""Empty Python environments that a wheel is installed in, without an index."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CLEAN = {
    key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")
}


@dataclass(frozen=True)
class Environment:
    """A virtual environment; commands run in it see nothing of the checkout."""

    folder: Path

    @property
    def python(self) -> Path:
        return self.folder / "bin" / "python"

    @property
    def site(self) -> Path:
        return next((self.folder / "lib").glob("python3*")) / "site-packages"

    def run(self, *command: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
        """One command from bin/, which is expected to end with `code`."""
        path = self.folder / "bin" / command[0]
        done = subprocess.run(
            [path, *command[1:]], capture_output=True, text=True, cwd=self.folder, env=CLEAN, check=False
        )
        assert done.returncode == code, f"{command}: {done.returncode}\n{done.stdout}{done.stderr}"
        return done

    def script(self, text: str, *arguments: str | Path) -> str:
        """Standard output of a Python program."""
        return self.run("python", "-c", text, *arguments).stdout

    def install(self, *wheels: Path) -> None:
        """Installs wheels; without an index pip fails where they ask for what was not lent."""
        self.pip("install", "--no-index", "--no-compile", *wheels)

    def pip(self, *arguments: str | Path) -> None:
        """This interpreter's pip, working on the environment, which has none."""
        command = [sys.executable, "-m", "pip", "--quiet", "--python", self.python, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, env=CLEAN, check=False)
        assert done.returncode == 0, done.stdout + done.stderr

    def lend(self, names: Iterable[str]) -> None:
        """Links installed distributions of this interpreter, and all that they need, into the environment."""
        for name in sorted(closure(names)):
            given = distribution(name)
            for top in {file.parts[0] for file in given.files or ()} - {"..", "__pycache__"}:
                place = self.site / top
                if not place.exists():
                    place.symlink_to(Path(str(given.locate_file(top))))


def empty(folder: Path) -> Environment:
    """A new environment without any package, pip included."""
    venv.create(folder, with_pip=False)
    return Environment(folder)


def closure(names: Iterable[str]) -> set[str]:
    """Canonical names of distributions, with all that they need and what that needs."""

    def needed(name: str) -> Iterator[str]:
        for line in distribution(name).requires or ():
            requirement = Requirement(line)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                yield canonicalize_name(requirement.name)

    found: set[str] = set()
    waiting = [canonicalize_name(name) for name in names]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(needed(name))
    return found
