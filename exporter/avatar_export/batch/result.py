"""What became of a row: plain data, the same in the memory of a client, in result.json and in a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, get_type_hints

from avatar_export.batch.locations import cleaned
from avatar_runtime.io.errors import AvatarError

STATES = ("done", "kept", "failed", "not done")
OK = ("done", "kept")


@dataclass(frozen=True)
class Result:
    """The end of one row. No text in it holds a password or a token."""

    name: str  # of the row
    state: str  # one of STATES; kept: it was finished before; not done: nobody came to it
    kind: str = ""  # of the failure, a key of `failures.KINDS`; "" without one
    message: str = ""  # one line: what failed, or what was doubtful
    remedy: str = ""  # one line: what to do
    output: str = ""  # the row's folder
    seconds: float = 0.0  # wall time
    cpu_seconds: float = 0.0
    peak_bytes: int = 0  # of the worker's process during the row
    sizes: Mapping[str, int] = field(default_factory=dict)  # product -> bytes
    psnr: float | None = None  # dB of the pack inside the avatar's outline, as `pack` prints it
    worker: str = ""
    attempts: int = 1
    retryable: bool = False  # whether another attempt may end otherwise

    def __post_init__(self) -> None:
        """Takes what is secret out of the message: libraries put URLs into theirs."""
        object.__setattr__(self, "message", cleaned(self.message))

    @property
    def ok(self) -> bool:
        """Whether the row's output is there."""
        return self.state in OK

    def as_json(self) -> dict[str, Any]:
        """Its fields, as JSON data."""
        return asdict(self)


def from_json(said: Any, file: str) -> Result:
    """The result in JSON data. Raises AvatarError, naming `file`, for a field that is missing or of another type."""
    known = get_type_hints(Result)
    if not isinstance(said, dict) or said.keys() != known.keys():
        raise AvatarError("is not a result of this version; make the row again", file=file)
    kinds: dict[Any, tuple[type, ...]] = {
        str: (str,),
        bool: (bool,),
        int: (int,),
        float: (int, float),
        float | None: (int, float, type(None)),
        Mapping[str, int]: (dict,),
    }
    for name, value in said.items():
        if not isinstance(value, kinds[known[name]]):
            raise AvatarError("is of another type; make the row again", file=file, field=name)
    return Result(**said)
