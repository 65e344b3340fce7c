"""What the viewer page hears, and by which messages: the protocol between page and server.

`./session.json`, or the same JSON in an element `<script type="application/json" id="session">` of the page:

    {"avatars": [{"id", "name", "file", "preview", "bytes", "license", "consent"}], "live": false, "events": true,
     "present": false, "gallery": null, "talk": {"tracker.js": ADDRESS, ...}}

`id` is lower case letters, digits and hyphens; `?avatar=ID` asks the page for that avatar. `file` (the pack) and
`preview` (a WebP image, or null) are addresses relative to the page, or `data:` addresses where everything is in one
file. `bytes` is the size of the pack. `license` and `consent` are text or null. `live` says that motion may arrive.
`events` says that the WebSocket `./events` is there; a published folder has none. `present` says that the page opens
with the avatar alone, and its controls by a button. `gallery` is the address of a page with all avatars, or null.
`talk` has the address of each file of `serving.talk`, or is null: then the page offers no camera.

`./events`, server to page, one JSON text each:

    {"type": "changed", "id"}       the file changed: read session.json again and load the avatar again
    {"type": "message", "text"}     one line for the person who looks; "" takes it away
    {"type": "live", "time", "weights", "head", "left_eye", "right_eye", "received_ms"}

A live frame has `weights` [52] in the order of ARKIT_NAMES, and (yaw, pitch, roll) in radians of the head and of the
channels leftEye* and rightEye*, as a Live Link Face recording has them. `time` is seconds since the server began, when
the frame arrived, and names the frame. `received_ms` is the same moment as milliseconds since 1970. Only the newest
frame is sent, at most MOST_A_SECOND a second.

Page to server: {"type": "shown", "time"} once the picture has the pose of that frame. The server measures the latency
by it, and sends no more than IN_FLIGHT frames ahead of it.

`./live`, from any program to the server: {"weights": {"jawOpen": 0.5}, "head": [yaw, pitch, roll], "left_eye": [...],
"right_eye": [...]}; `weights` may be a list [52], and everything may be left out. The answer to a message that is not
understood is {"type": "message", "text"}.
"""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from avatar_runtime.packs import decode_pack

MOST_A_SECOND = 60  # live frames to a page
IN_FLIGHT = 3  # live frames that a page has not acknowledged
LONGEST_ID = 48  # letters
NOT_IN_ID = re.compile("[^a-z0-9]+")
# Windows opens no file of such a name, with any suffix.
DEVICES = re.compile("con|prn|aux|nul|(com|lpt)[0-9]")


@dataclass(frozen=True)
class Shown:
    """One avatar of a session: the checked pack and what a person reads about it."""

    id: str
    name: str
    pack: bytes
    preview: bytes | None  # WebP
    license: str | None
    consent: str | None


def shown(identity: str, pack: bytes, file: str) -> Shown:
    """The avatar in the bytes of a pack. Raises AvatarError, naming `file`, for a pack that is unsound."""
    held = decode_pack(pack, file)
    said = held.avatar.provenance
    return Shown(
        identity, held.avatar.name, pack, held.preview, _text(said, "licence"), _text(said, "consent")
    )


def _text(said: Any, key: str) -> str | None:
    value = said.get(key)
    return None if value is None else str(value)


def session(
    avatars: Sequence[Shown],
    files: Sequence[str],
    previews: Sequence[str | None],
    *,
    live: bool = False,
    events: bool = False,
    present: bool = False,
    gallery: str | None = None,
    talk: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """The document session.json: `files` and `previews` are addresses of each avatar's, `talk` of the tracker's."""
    return {
        "avatars": [
            {
                "id": avatar.id,
                "name": avatar.name,
                "file": file,
                "preview": preview,
                "bytes": len(avatar.pack),
                "license": avatar.license,
                "consent": avatar.consent,
            }
            for avatar, file, preview in zip(avatars, files, previews, strict=True)
        ],
        "live": live,
        "events": events,
        "present": present,
        "gallery": gallery,
        "talk": None if talk is None else dict(talk),
    }


def compact(value: Any) -> str:
    """One line of JSON."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def identity(name: str, taken: Collection[str]) -> str:
    """An id from any text, safe as a file name and in an address, and not among those `taken`."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    base = NOT_IN_ID.sub("-", plain)[:LONGEST_ID].strip("-") or "avatar"
    if DEVICES.fullmatch(base):
        base = f"avatar-{base}"
    number, found = 1, base
    while found in taken:
        number += 1
        found = f"{base}-{number}"
    return found
