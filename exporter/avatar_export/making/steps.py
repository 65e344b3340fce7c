"""The table of steps from a film to an avatar: what each runs, and what it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from avatar_export.making.options import DEFAULTS, Film, Wanted, words
from avatar_export.options import Options, declared
from avatar_export.serving.session import identity

T = TypeVar("T", bound=Options)
TRAINER, EXPORTER = "avatar_trainer", "avatar_export"
WORDS = ("--consent", "--licence", "--author")  # they go into capture and bundle without a new training


@dataclass(frozen=True)
class Step:
    """One run of a program."""

    name: str  # of what it writes into the folder
    about: str
    made_of: tuple[str, ...]  # options that it depends on, beside the steps before it
    module: str
    words: tuple[str, ...]
    anew: bool = False  # its program replaces no older result: that is removed first


@dataclass(frozen=True)
class Plan:
    """An avatar that is made of the film `video` in the folder `out`."""

    video: Path
    out: Path
    film: Film
    wanted: Wanted
    accept_misfit: bool = False

    @property
    def pack(self) -> str:
        """Name of the pack's file."""
        return f"{identity(str(self.wanted.name), ())}.avatar"

    def options(self) -> Mapping[str, Any]:
        """Every option that the result depends on, by its flag."""
        return {
            one.flag: getattr(given, name)
            for given in (self.film, self.wanted)
            for name, one in declared(type(given)).items()
        }

    def filled(self, before: Mapping[str, Any]) -> Plan:
        """What is left out is as `before`, by flags, else the default. Raises TypeError or ValueError for values before
        that are none of these options."""
        whole: dict[str, Any] = {**DEFAULTS, "--name": self.out.resolve().name}
        for one in (before, self.options()):
            whole |= {flag: value for flag, value in one.items() if value is not None}
        return replace(self, film=_from(Film, whole), wanted=_from(Wanted, whole))

    def steps(self) -> tuple[Step, ...]:
        """All of them, in their order, of a plan that is filled."""
        wanted, film = self.wanted, self.film
        capture, run, bundle, pack = (
            str(self.out / name) for name in ("capture", "run", "bundle", self.pack)
        )
        said = words(wanted, ("name", "seed", "consent", "license", "author"))
        training = tuple(words(wanted, ("iterations", "gaussians", "seed")))
        return (
            Step(
                "capture", "finds and tracks the face",
                (*(one.flag for one in declared(Film).values()), "--name", "--seed"), TRAINER,
                ("capture", str(self.video), "-o", capture, *words(film, [*declared(Film)]), *said),
            ),
            Step(
                "check", "compares mesh and images", (), TRAINER,
                ("check", capture, "--pictures", str(self.out / "check")), anew=True,
            ),
            Step(
                "run", f"trains {wanted.system}, {wanted.iterations} iterations",
                ("--system", "--iterations", "--gaussians"), TRAINER,
                (str(wanted.system), capture, "-o", run, *training, *["--accept-misfit"] * self.accept_misfit),
            ),
            Step(
                "bundle", "writes the files for engines", WORDS, TRAINER,
                ("export", run, bundle, "--capture", capture, "--force"),
            ),
            Step(
                self.pack, "packs the avatar for players", (), EXPORTER,
                ("pack", bundle, "-o", pack, "--force"),
            ),
            Step(
                "page", "publishes it", (), EXPORTER,
                ("publish", pack, "-o", str(self.out / "page"), "--force"),
            ),
        )  # fmt: skip

    def drop(self, into: Path) -> Step:
        """The avatar into a project: run each time, since the project may have changed."""
        name = str(self.wanted.name)
        given = ("drop", str(self.out / "bundle"), "--into", str(into), "--name", name)
        return Step("drop", f"puts it into {into}", (), EXPORTER, given)


def _from(kind: type[T], values: Mapping[str, Any]) -> T:
    """Options of a kind, from values by flag."""
    return kind(**{name: values.get(one.flag) for name, one in declared(kind).items()})
