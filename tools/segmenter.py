"""Makes film/data/selfie_segmenter.tflite of the trainer: `python -m tools.segmenter SELFIE_SEGMENTATION.tflite`.

The network is that of the npm package @mediapipe/selfie_segmentation 0.1.1675465747 (Google, Apache-2.0). MediaPipe's
image segmenter refuses it without metadata: these say that its input is RGB over 255, and its output a mask.
"""

from __future__ import annotations

import sys
import types
from importlib import import_module
from pathlib import Path

OUT = Path(__file__).parents[1] / "trainer/avatar_trainer/film/data/selfie_segmenter.tflite"
NATIVE = "mediapipe.tasks.cc.metadata.python._pywrap_metadata_version"  # the wheel lacks it
PARSER = "1.0.0"  # the least version of a parser that these metadata need


def main() -> None:
    """The command."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    parts = NATIVE.split(".")
    for count in range(3, len(parts) + 1):
        module = types.ModuleType(".".join(parts[:count]))
        sys.modules.setdefault(module.__name__, module)
    native = sys.modules[NATIVE]
    native.__dict__["GetMinimumMetadataParserVersion"] = lambda _: PARSER
    sys.modules[NATIVE.rpartition(".")[0]].__dict__[parts[-1]] = native
    writers = import_module("mediapipe.tasks.python.metadata.metadata_writers.metadata_writer")
    writer = writers.MetadataWriter.create(Path(sys.argv[1]).read_bytes())
    writer.add_image_input([0.0], [255.0])
    writer.add_segmentation_output(labels=None)
    OUT.write_bytes(writer.populate()[0])
    del writer  # before the interpreter takes down what it needs for that
    print(OUT)


if __name__ == "__main__":
    main()
