"""Limit numerical libraries to one thread: frames run in parallel, and float sums are the same on every machine."""

import os

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1")
"""Environment variables that limit numerical libraries to one thread."""


def single_thread() -> None:
    """Limit OpenMP, BLAS and OpenCV to one thread in this process; call it before numpy is imported."""
    os.environ.update(ONE_THREAD)
    import cv2

    cv2.setNumThreads(1)
