"""The rows of a batch: what is read, with which options, where its products go."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from avatar_export.batch import row_options, stores
from avatar_export.batch.locations import leaf, like_url, normal
from avatar_runtime.io.errors import no_such

STEPS = ("pack", "validate", "conform", "render", "publish")  # in the order in which they are done
LONGEST = 100  # bytes of a product's name: what is written aside gets a longer one, and disks take 255
NEEDS = {"conform": "reference"}  # step -> the option of `convert` that it needs


@dataclass(frozen=True)
class Job:
    """One row. Locations are paths or URLs of a store; they become absolute.

    Raises TypeError and ValueError for an option or a step that does not exist, and for a value of another type.
    """

    name: str
    source: str  # what `convert` reads
    output: str  # the row's folder
    options: Mapping[str, Any] = field(default_factory=dict)  # `row_options.OPTIONS`
    steps: tuple[str, ...] = ()  # some of STEPS, besides converting

    def __post_init__(self) -> None:
        """Brings every field to its form."""
        for known, given, what in (
            (row_options.OPTIONS, self.options, "option"),
            (STEPS, self.steps, "step"),
        ):
            for name in given:
                if name not in known:
                    raise ValueError(no_such(what, str(name), known).message)
        if not self.name.strip() or not self.name.isprintable():
            raise ValueError(f"{self.name!r} cannot be the name of a row")
        if like_url(self.name):
            raise ValueError("a URL cannot be the name of a row, since it could hold a password")
        options = {
            name: row_options.checked(name, value, ".")
            for name, value in self.options.items()
            if value is not None
        }
        for step in self.steps:
            if step in NEEDS and options.get(NEEDS[step]) is False:
                raise ValueError(f"the step {step} needs the option {NEEDS[step]}")
        object.__setattr__(self, "options", options)
        object.__setattr__(self, "steps", tuple(step for step in STEPS if step in self.steps))
        object.__setattr__(self, "source", normal(self.source))
        object.__setattr__(self, "output", normal(self.output))
        if self.product.lower().endswith(".zip"):
            raise ValueError(f"the output {self.output} is a folder; leave .zip out")
        if self.product == stores.RECORD:
            raise ValueError(f"the output {self.output} has the name of a file in it; name it otherwise")
        if len(os.fsencode(self.product)) > LONGEST:
            raise ValueError(
                f"the output {self.product[:40]}... has a name of more than {LONGEST} bytes; shorten it"
            )

    @property
    def inputs(self) -> dict[str, str]:
        """Role -> location of all that is read: the source, and the files that options name."""
        return {"source": self.source, **row_options.locations(self.options)}

    @property
    def product(self) -> str:
        """The name of its products: the last part of its output."""
        return leaf(self.output)
