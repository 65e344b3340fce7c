"""The version of this package, read from the distribution that installed it."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

DISTRIBUTIONS = (
    "avatar-runtime",
    "avatar-export",
)  # the second contains this package if the first is not installed
UNKNOWN = "0+unknown"  # of a source tree that was never installed


def installed_version() -> str:
    """The version of the first of DISTRIBUTIONS that is installed, or UNKNOWN."""
    for name in DISTRIBUTIONS:
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return UNKNOWN


__version__ = installed_version()
