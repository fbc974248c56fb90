"""Choose the number of worker processes for "auto": as many as processors, memory and frames allow."""

import math
import os
from contextlib import suppress
from pathlib import Path

from ..errors import InputError

AUTO = "auto"

WORKER_BYTES = 750_000_000
"""Memory of a worker in bytes: 170 MB while it processes a 1280x720 frame, plus the frames kept until they are drawn."""

FRAMES_PER_WORKER = 20
"""Number of frames per worker from which on it pays to start one; the start takes as long as ten frames."""


def worker_count(wanted: int | str, frames: int) -> int:
    """Return the number of worker processes for a number of frames; 0 for this process alone.

    wanted : the number, also as a text, or "auto".

    Raises
    ------
    InputError : `wanted` is neither a number nor "auto".
    """
    if wanted == AUTO:
        most = min(usable_processors(), _usable_bytes() // WORKER_BYTES, frames // FRAMES_PER_WORKER)
        return int(most) if most > 1 else 0
    with suppress(ValueError):
        if (count := int(wanted)) >= 0:
            return count
    raise InputError(f"workers {str(wanted)[:20]}: expected a number from 0, or auto", code="value-invalid")


def usable_processors() -> int:
    """Return the number of processors that this process may use, by its affinity and the limit of its container."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with suppress(OSError, ValueError):  # cgroups of Linux: microseconds of processors in a period
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text(encoding="ascii").split()
        count = min(count, math.ceil(int(quota) / int(period)))  # ValueError where it is "max"
    return max(1, count)


def _usable_bytes() -> float:
    """Return the free or freeable memory in bytes; infinite if unknown."""
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    with suppress(OSError, ValueError, AttributeError):
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return math.inf
