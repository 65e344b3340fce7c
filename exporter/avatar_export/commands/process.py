"""The process of a command line, from its first moment: standard streams, signals, memory. Nothing large is imported.

Exit codes of both programs: 0 done; 1 done, and something was found or a budget was missed; 2 bad data or a usage
error; 3 too little memory; 128 + n ended by signal n, as the shell has it (129 SIGHUP, 130 Ctrl+C, 143 SIGTERM), 141
where whatever read standard output was gone.
"""

from __future__ import annotations

import _thread
import errno
import importlib
import importlib.util
import io
import os
import signal
import sys
import threading
import time
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

from avatar_export.commands.memory import Need, need_of, shortage
from avatar_schema.extras import how_to_install

LITTLE_MEMORY = 3  # exit code
BY_SIGNAL = 128  # exit code of a process that a signal ended: this plus the signal's number
PIPE = 13  # number of SIGPIPE, which Windows does not have
AGAIN = 0.05  # seconds after which a signal is sent again that something swallowed, or that came too early
ENDING = ("SIGTERM", "SIGHUP")
ENDS = (KeyboardInterrupt, SystemExit)
DRAW = {"convert", "batch", "pack", "view", "publish", "conform", "render", "distill"}  # commands
IMPORTLIB = "<frozen importlib._bootstrap>"  # the file of Python's frames that load modules


def start(program: str, module: str, needs: Mapping[str, Need]) -> None:
    """Entry point: the function `main` of `module`, once the streams are sound and there is enough memory."""
    open_streams()
    lacking = shortage(need_of(needs, sys.argv[1:]))
    if lacking:
        print(f"{program}: {lacking}", file=sys.stderr)
        sys.exit(LITTLE_MEMORY)
    slow = without_numba(sys.argv[1:])
    if slow:
        print(f"{program}: {slow}", file=sys.stderr)
    # While modules are loaded, Ctrl+C ends the process at once: nothing is begun, and libraries swallow exceptions.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    importlib.import_module(module).main()


def without_numba(arguments: Sequence[str]) -> str | None:
    """One line if a command line draws by backend `cpu` where that is installed, and it is not."""
    asked = any(word.startswith("--backend") for word in arguments)
    if asked or not {*arguments[:1]} & DRAW or importlib.util.find_spec("numba"):
        return None
    return f"without Numba drawing takes some 40 times as long, and so does `pack --levels`: {how_to_install('fast')}"


def open_streams() -> None:
    """Makes the standard streams sound.

    A closed one becomes the null device, so that no file of ours gets its number. Text that standard error does not
    take is dropped; for standard output see `_Output`.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
            os.set_inheritable(descriptor, True)
    if sys.stdin is None:
        sys.stdin = io.TextIOWrapper(io.BufferedReader(io.FileIO(0, closefd=False)), encoding="utf-8")
    sys.stdout = _rewrapped(sys.stdout, 1, _Output)
    sys.stderr = _rewrapped(sys.stderr, 2, _Messages)


def _rewrapped(stream: Any, descriptor: int, kind: type[io.TextIOWrapper]) -> Any:
    if stream is None:
        return kind(
            io.BufferedWriter(io.FileIO(descriptor, "w", closefd=False)), "utf-8", line_buffering=True
        )
    if type(stream) is not io.TextIOWrapper:
        return stream  # somebody else's
    return kind(stream.buffer, stream.encoding, "backslashreplace", line_buffering=stream.line_buffering)


class _Messages(io.TextIOWrapper):
    """Standard error: the work goes on where nobody can read of it."""

    def write(self, text: str) -> int:
        with suppress(OSError):
            super().write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(OSError):
            super().flush()


class _Output(io.TextIOWrapper):
    """Standard output: SystemExit where whatever read it is gone, AvatarError where it cannot be written."""

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError as error:
            self._lost(error)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError as error:
            self._lost(error)

    def _lost(self, error: OSError) -> NoReturn:
        from avatar_runtime.io.errors import AvatarError  # loads NumPy

        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, self.fileno())  # takes what is still in buffers
        os.close(null)
        if error.errno == errno.EPIPE:
            raise SystemExit(BY_SIGNAL + PIPE) from None
        raise AvatarError(f"cannot be written ({error.strerror or error})", file="standard output") from None


@contextmanager
def ending_by_signals(program: str) -> Iterator[None]:
    """Signals that end the process raise an exception in the block, so that nothing is left half-written. After it come
    one line and SystemExit.

    Ctrl+C: KeyboardInterrupt; SIGTERM and SIGHUP: SystemExit. While a module is loaded the exception waits: native
    libraries swallow it, or print it. One that is swallowed elsewhere comes again. What the parent process has ignored
    stays ignored. Changes nothing outside of the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    ending = _Ending()
    numbers = [signal.SIGINT, *(getattr(signal, name) for name in ENDING if hasattr(signal, name))]
    before = {number: signal.getsignal(number) for number in numbers}
    hook = sys.unraisablehook
    try:
        for number in numbers:
            if before[number] not in (signal.SIG_IGN, None):  # None: set by C code
                signal.signal(number, ending.asked)
        sys.unraisablehook = lambda lost: None if isinstance(lost.exc_value, ENDS) else hook(lost)
        yield
    except BaseException:
        if ending.number is None:
            raise
    finally:
        ending.over = True
        sys.unraisablehook = hook
        for number, handler in before.items():
            if handler is not None:
                signal.signal(number, handler)
    if ending.number is not None:
        print(f"{program}: ended by {_name(ending.number)}", file=sys.stderr)
        raise SystemExit(BY_SIGNAL + ending.number)


class _Terminated(SystemExit):
    """A signal other than Ctrl+C."""


class _Interrupted(KeyboardInterrupt):
    """Ctrl+C. A class of its own, since weak references need one that is made in Python."""


class _Ending:
    """The signal that ends a block, until the block has ended."""

    def __init__(self) -> None:
        self.number: int | None = None
        self.over = False
        self._main = threading.get_ident()
        self._raised: weakref.ref[BaseException] | None = None

    def asked(self, number: int, frame: FrameType | None) -> None:
        """The handler of the signals."""
        self.number = number
        if _loads(frame):
            self._again()
            return
        error = _Interrupted() if number == signal.SIGINT else _Terminated(BY_SIGNAL + number)
        # It lives as long as it ends something. If it dies before the block has ended, something has swallowed it.
        self._raised = weakref.ref(error, lambda _: self._again())
        try:
            raise error
        finally:
            del error  # else the error and this frame keep each other alive

    def _again(self) -> None:
        """Sends the signal once more, soon. A bare thread: handlers run anywhere, inside `threading` too."""
        if not self.over:
            # No memory for a thread: the end of the block still ends the process.
            with suppress(RuntimeError):
                _thread.start_new_thread(self._send, ())

    def _send(self) -> None:
        time.sleep(AGAIN)
        if self.over or self.number is None:
            return
        if hasattr(signal, "pthread_kill"):  # wakes a main thread that waits; Windows cannot
            signal.pthread_kill(self._main, self.number)
        else:
            signal.raise_signal(self.number)


def _loads(frame: FrameType | None) -> bool:
    """Whether a module is being loaded."""
    while frame is not None:
        if frame.f_code.co_filename == IMPORTLIB:
            return True
        frame = frame.f_back
    return False


def _name(number: int) -> str:
    return "Ctrl+C" if number == signal.SIGINT else signal.Signals(number).name
