"""An enhancer in ONNX Runtime."""

from __future__ import annotations

import numpy as np
import onnxruntime

from avatar_runtime.avatar import F32, Enhancer
from avatar_runtime.codec.manifest import ENHANCER_FILE
from avatar_runtime.enhance.network import read_network
from avatar_runtime.io.errors import AvatarError

THREADS = 1  # always the same number: sums may depend on the number of threads
SILENT = 4  # errors that it would log are also raised as exceptions


class Session:
    """Runs one enhancer. Its file is checked once, its memory and time once for each image size."""

    def __init__(self, enhancer: Enhancer) -> None:
        """Raises AvatarError for a file that is not valid."""
        self._network = read_network(enhancer)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = THREADS
        options.use_deterministic_compute = True
        options.log_severity_level = SILENT
        try:
            self._session = onnxruntime.InferenceSession(
                self._network.model.SerializeToString(), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # its exceptions have no base of their own
            raise _refused(error) from None
        self._sizes: set[tuple[int, int]] = set()

    def __call__(self, colour: F32) -> F32:
        """The enhanced colour [H, W, 3], not clamped.

        Raises AvatarError if it would take too much memory, cannot run or gives another shape or non-finite numbers.
        """
        size = (colour.shape[0], colour.shape[1])
        if size not in self._sizes:
            self._network.check_size(*size)
            self._sizes.add(size)
        planes = np.ascontiguousarray(colour.transpose(2, 0, 1)[None], np.float32)
        try:
            (better,) = self._session.run([self._network.output], {self._network.input: planes})
        except Exception as error:
            raise _refused(error) from None
        if better.shape != planes.shape or not np.isfinite(better).all():
            raise AvatarError("does not give an image of finite numbers", file=ENHANCER_FILE)
        return np.ascontiguousarray(better[0].transpose(1, 2, 0))


def _refused(error: Exception) -> AvatarError:
    return AvatarError(f"cannot be run ({str(error)[:200]})", file=ENHANCER_FILE)
