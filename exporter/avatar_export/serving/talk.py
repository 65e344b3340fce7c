"""The files that let a visitor's camera drive an avatar in a page: the face tracker, MediaPipe's code and its model.

`python -m tools.face_landmarker` gets those that are other people's; `node players/web/build.mjs page` makes
tracker.js.
"""

from __future__ import annotations

from pathlib import Path

from avatar_runtime.io.errors import AvatarError

FOLDER = Path(__file__).resolve().parents[1] / "talk"
TRACKER, MODEL = "tracker.js", "face_landmarker.task"
# The others, and the SHA-256 of what they hold, inflated: MediaPipe's code (npm), and the model of its face landmarker.
FOREIGN = {
    "vision_bundle.js": "7fba4f9807297e229371318df577e96fc9f1b3d93e79075e3798ade2fc790c9e",
    "vision_wasm_internal.js": "e7fd9858e8e8f221d9b96eddc11f8e077f263e0b7bbd79d3cbe882b134274f8c",
    "vision_wasm_internal.wasm.gz": "6a5c64584c2ab61c763b6e204afbdbc7ce1caf7f5216187322bca8df94f646bc",
    MODEL: "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff",
}


def talk_files() -> dict[str, bytes]:
    """The files by name. Raises AvatarError where one was not installed."""
    paths = [FOLDER / name for name in (TRACKER, *FOREIGN)]
    missing = next((path for path in paths if not path.is_file()), None)
    if missing is not None:
        raise AvatarError("is missing; install avatar-export again", file=missing)
    return {path.name: path.read_bytes() for path in paths}
