"""The version of this package, read from the distribution that installed it."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

from avatar_schema.extras import DISTRIBUTIONS

UNKNOWN = "0+unknown"  # of a source tree that was never installed


def installed_version() -> str:
    """That of the first of DISTRIBUTIONS that is installed, or UNKNOWN; a checkout installs as the second alone."""
    for name in DISTRIBUTIONS:
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return UNKNOWN


__version__ = installed_version()
