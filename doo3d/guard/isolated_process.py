"""Run the separate process in which native readers are called; see `isolation`."""

import os
import signal
import sys
from contextlib import suppress
from typing import Any

from ..errors import DooError, InputError
from .guarding import first_line, guarded
from .isolation import receive, send
from .limits import limited

_BYTES_PER_POINT = 100  # of a reader: columns of the file, coordinates as float64, colors, and copies
_BASE_BYTES = 512 << 20  # of libraries that load at their first call


def main() -> None:
    """Answer requests on stdin until it is closed; ignore Ctrl-C, which the waiting program handles."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests = os.fdopen(os.dup(0), "rb")
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not come between answers
    while True:
        try:
            request = receive(requests)
        except EOFError:
            return
        send(answers, _answer(*request))
        del request


def _answer(function: Any, args: tuple[Any, ...], limits: Any, folder: str, where: str, memory: int | None) -> tuple[str, Any]:
    with suppress(OSError):
        os.chdir(folder)
    _bound_memory(_BASE_BYTES + _BYTES_PER_POINT * limits.max_points if memory is None else memory)
    try:
        with guarded(where), limited(limits):
            return "value", function(*args)
    except DooError as error:
        return "error", error
    except BaseException as error:  # such as a panic of a library in Rust
        return "error", InputError(f"{where}: is damaged ({first_line(error)})", code="file-damaged")


def _bound_memory(more: int) -> None:
    """Limit the memory of this process to `more` bytes above the current use, on platforms that support it."""
    if sys.platform != "linux":
        return
    import resource

    with open("/proc/self/statm", encoding="ascii") as file:
        now = int(file.read().split()[5]) * resource.getpagesize()
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    wanted = now + more if hard == resource.RLIM_INFINITY else min(now + more, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (wanted, hard))
