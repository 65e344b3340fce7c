"""Results that no row writes itself, since it did not come to its end."""

from __future__ import annotations

from avatar_export.batch.failures import KINDS
from avatar_export.batch.locations import cleaned
from avatar_export.batch.result import Result

GIGABYTE = 1e9


def too_large(name: str, memory_bytes: int, largest_bytes: int) -> Result:
    """Of a row for which no worker has memory."""
    return Result(
        name,
        "failed",
        "memory",
        f"needs about {memory_bytes / GIGABYTE:.1f} GB, but no worker has more than {largest_bytes / GIGABYTE:.1f} GB",
        KINDS["memory"].remedy,
        attempts=0,
    )


def killed(name: str, deaths: int) -> Result:
    """Of a row of which too many workers died."""
    return Result(
        name,
        "failed",
        "worker",
        f"{deaths} workers died while they did it",
        KINDS["worker"].remedy,
        attempts=deaths,
    )


def broken(name: str, error: BaseException) -> Result:
    """Of a row that raised an exception."""
    said = cleaned(" ".join(str(error).split()))  # before it is cut
    return Result(
        name,
        "failed",
        "bug",
        f"{type(error).__name__}: {said}"[:1000],
        KINDS["bug"].remedy,
        retryable=KINDS["bug"].retryable,
    )


def not_done(name: str) -> Result:
    """Of a row that the batch did not come to before it was stopped."""
    return Result(name, "not done", remedy="--resume does what is missing", attempts=0)
