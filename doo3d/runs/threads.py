"""One thread per process: frames are what runs side by side, and sums come out the same on every machine."""

from __future__ import annotations

import os

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


def single_thread() -> None:
    """Hold this process to one thread; to be called before numpy and numba are imported."""
    os.environ.update(ONE_THREAD)
    import cv2

    cv2.setNumThreads(1)
