"""Names of files and folders: local paths, and URLs of the stores that a batch reads and writes."""

from __future__ import annotations

import os
import posixpath
import re
from pathlib import Path

STORES = {  # as a URL begins -> the store's one name
    "file": "file",
    "gcs": "gs",
    "gs": "gs",
    "memory": "memory",
    "s3": "s3",
    "s3a": "s3",
}
URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://(.*)", re.DOTALL)
PERSON = re.compile(
    r"([A-Za-z][A-Za-z0-9+.-]*://)[^/\s'\"]*@"
)  # user:password@ in a text; a password may hold @
QUERY = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*://[^\s?'\"]*)\?[^\s'\"]*")


def is_url(location: str) -> bool:
    """Whether a location is a URL, and no path of this machine."""
    return URL.match(location) is not None


def normal(location: str) -> str:
    """One spelling for each place: an absolute path, or STORE://FOLDER/NAME without a slash at its end.

    Raises ValueError for an empty location, a store that is not in STORES, and a URL that holds a password.
    """
    if not location.strip() or "\0" in location:
        raise ValueError("names nothing; a path or a URL is needed")
    found = URL.match(location)
    if found is None:
        return Path(os.path.abspath(os.path.expanduser(location))).as_posix()
    store, rest = STORES.get(found[1].lower()), found[2]
    if store is None or "::" in location:
        known = ", ".join(f"{name}://" for name in sorted(set(STORES.values())))
        raise ValueError(f"{cleaned(location)[:80]!r} is in no known store; a path or {known} is needed")
    if store == "file":
        return os.path.abspath(f"/{rest.lstrip('/')}")
    if "@" in rest.partition("/")[0] or "?" in rest:
        raise ValueError(
            f"{cleaned(location)[:80]!r} holds a password or a token; credentials come from the environment"
        )
    path = posixpath.normpath(f"/{rest}").strip("/")
    if not path:
        raise ValueError(f"{location!r} names a whole store; a folder or a file in it is needed")
    return f"{store}://{path}"


def is_private(location: str) -> bool:
    """Whether only the process itself can read a normal location."""
    return location.startswith("memory://")


def joined(base: str, location: str) -> str:
    """`location` as seen from the folder `base`; an absolute path or a URL is kept."""
    if is_url(location) or os.path.isabs(os.path.expanduser(location)):
        return location
    return f"{base.rstrip('/') or '/'}/{location}"


def parent(location: str) -> str:
    """The folder that holds a normal location."""
    return location.rpartition("/")[0] or "/"


def leaf(location: str) -> str:
    """The last name of a normal location."""
    return location.rpartition("/")[2]


def cleaned(text: str) -> str:
    """`text` without what URLs in it may hold besides an address: user, password, and query with its tokens."""
    return QUERY.sub(r"\1?...", PERSON.sub(r"\1", text))
