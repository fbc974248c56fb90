"""The number of worker processes that is meant by "auto": as many as processors, memory and frames allow."""

import math
import os
from contextlib import suppress
from pathlib import Path

from ..errors import InputError

AUTO = "auto"

WORKER_BYTES = 750_000_000
"""Memory that a worker takes: 170 MB with a frame of 1280x720 in work, and the frames that it keeps until they are drawn."""

FRAMES_PER_WORKER = 20
"""Frames for which a worker is worth its start, which takes as long as ten frames."""


def worker_count(wanted: int | str, frames: int) -> int:
    """Return the number of worker processes for so many frames; 0 for this process alone.

    wanted : the number, also as a text, or "auto".

    Raises
    ------
    InputError : it is neither.
    """
    if wanted == AUTO:
        most = min(usable_processors(), _usable_bytes() // WORKER_BYTES, frames // FRAMES_PER_WORKER)
        return int(most) if most > 1 else 0
    with suppress(ValueError):
        if (count := int(wanted)) >= 0:
            return count
    raise InputError(f"workers {str(wanted)[:20]}: expected a number from 0, or auto", code="value-invalid")


def usable_processors() -> int:
    """Return the number of processors that this process may use: its affinity, and the limit of its container."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with suppress(OSError, ValueError):  # cgroups of Linux: microseconds of processors in a period
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text(encoding="ascii").split()
        count = min(count, math.ceil(int(quota) / int(period)))  # ValueError where it is "max"
    return max(1, count)


def _usable_bytes() -> float:
    """Return the memory, bytes, that is free or can be freed; infinite where it is unknown."""
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    with suppress(OSError, ValueError, AttributeError):
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return math.inf
