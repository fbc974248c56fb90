"""Hot loops, compiled with numba on first use and kept on disk: free functions on plain arrays."""

from __future__ import annotations

from pathlib import Path


def compiled() -> bool:
    """Whether the kernels were compiled before, so that the next run does not spend seconds on it."""
    from numba.core.caching import FunctionCache

    from . import (
        arcs,
        matching,
        thinning,
    )
    from . import (
        depth_filter as depth,
    )
    from . import (
        end_tangents as ends,
    )
    from . import (
        equal_chords as walking,
    )
    from . import (
        second_best as exchanging,
    )
    from . import (
        skeleton_graph as tracing,
    )

    kernels = (
        *(arcs.path, depth.agreement, ends.courses, exchanging.least, matching.settle),
        *(thinning.thin, thinning.link, tracing.trace, walking.walk),
    )
    folders = [Path(FunctionCache(kernel.py_func).cache_path) for kernel in kernels]
    return all(
        any(folder.glob(f"{Path(kernel.py_func.__code__.co_filename).stem}.{kernel.py_func.__name__}-*.nbi"))
        for folder, kernel in zip(folders, kernels, strict=True)
    )
