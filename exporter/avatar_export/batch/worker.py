"""What runs in a worker: one attempt of a task.

Dask imports this module in each worker of this machine when it starts.
"""

from __future__ import annotations

import signal
import threading
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from distributed import Worker, get_worker

from avatar_export.batch.result import Result

_alone = threading.Lock()


def dask_setup(worker: Worker) -> None:
    """Called by Dask in a new worker of this machine: Ctrl+C reaches all processes of a terminal, and the batch itself
    ends its workers.
    """
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def attempt(call: Callable[[str], Result], key: str, topic: str, alone: bool) -> Result:
    """One attempt: `call` with a text that no other attempt has.

    Tells under the Dask topic `topic` that the task `key` begins here. `alone`: not beside another task in this worker.
    """
    waiting: AbstractContextManager[object] = _alone if alone else nullcontext()
    with waiting:
        worker = get_worker()
        own = uuid.uuid4().hex
        worker.log_event(topic, {"key": key, "attempt": own, "by": str(worker.name)})
        return call(own)
