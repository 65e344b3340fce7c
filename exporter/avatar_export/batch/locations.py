"""Names of files and folders: local paths, and URLs of the stores that a batch reads and writes."""

from __future__ import annotations

import os
import posixpath
import re
from pathlib import Path
from urllib.parse import unquote

STORES = {  # as a URL begins -> the store's one name
    "file": "file",
    "gcs": "gs",
    "gs": "gs",
    "memory": "memory",
    "s3": "s3",
    "s3a": "s3",
}
URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://(.*)", re.DOTALL)
LIKE_URL = re.compile(r"://|(?:^|/|::)[A-Za-z][A-Za-z0-9+.-]+:/")  # also chained, or with one slash
AT, COLON, SLASH, ASK, HASH = (
    rf"(?:{sign}|%(?:25)*{ord(sign[-1]):X})" for sign in ("@", ":", "/", r"\?", "#")
)
START = rf"[A-Za-z][A-Za-z0-9+.-]{{1,30}}{COLON}{SLASH}+"  # of a URL in a text, also percent-encoded
# user:password@ in a text; a password may hold @, and after its colon also /
PERSON = re.compile(rf"({START})(?:[^/\s'\"]*{AT}|[^/\s'\":]+{COLON}[^\s'\"]{{0,2000}}{AT})", re.IGNORECASE)
QUERY = re.compile(rf"({START}[^\s?#'\"]*?)(?:{ASK}|{HASH})[^\s'\"]*", re.IGNORECASE)


def is_url(location: str) -> bool:
    """Whether a location is a URL, and no path of this machine."""
    return URL.match(location) is not None


def like_url(text: str) -> bool:
    """Whether a text is a URL, or holds one, in a spelling that somebody could take for one."""
    return LIKE_URL.search(_decoded(text)) is not None


def normal(location: str) -> str:
    """One spelling for each place: an absolute path, or STORE://FOLDER/NAME without a slash at its end.

    Raises ValueError for an empty location, a store that is not in STORES, and a URL that holds a password. The message
    does not repeat the location: nobody knows where in it a password ends.
    """
    if not location.strip() or "\0" in location:
        raise ValueError("names nothing; a path or a URL is needed")
    found, plain = URL.match(location), _decoded(location)
    if found is None and not like_url(location):
        return Path(os.path.abspath(os.path.expanduser(location))).as_posix()
    store = STORES.get(found[1].lower()) if found else None
    if found is None or store is None or "::" in plain:
        known = ", ".join(f"{name}://" for name in sorted(set(STORES.values())))
        raise ValueError(f"is a URL in no known store; a path or {known} is needed")
    host, _, rest = plain.partition("://")[2].partition("/")
    if "@" in host or ":" in host or any(sign in host + rest for sign in "?#"):
        raise ValueError("is a URL with a password or a token; credentials come from the environment")
    if store == "file":
        if host:
            raise ValueError("names another machine; a path, or file:/// and a path, is needed")
        return os.path.abspath(f"/{found[2].lstrip('/')}")
    path = posixpath.normpath(f"/{found[2]}").strip("/")
    if not path:
        raise ValueError(f"{store}:// names a whole store; a folder or a file in it is needed")
    return f"{store}://{path}"


def _decoded(text: str) -> str:
    """`text` without percent-encoding, also where it was encoded several times."""
    while (plain := unquote(text)) != text:
        text = plain
    return text


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
