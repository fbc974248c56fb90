"""Hot loops, compiled with numba on first use and kept on disk: free functions on plain arrays, no objects.

The letters of shapes mean the same in all of them:

N points or pixels, P points of a polyline, D in {2, 3} coordinates, S samples along centre lines, J joints, C chains,
E = 2 C ends of chains (end e is the first, even, or last, odd, of chain e // 2), M voxels, K pixels or voxels of a skeleton,
B branches, (H, W) rows and columns of an image. Lengths are in the unit of the coordinates: metres in 3-D, pixels in 2-D.
"""

from __future__ import annotations

from pathlib import Path


def are_compiled() -> bool:
    """Return whether the kernels were compiled before, so that the next run does not spend seconds on it."""
    from numba.core.caching import FunctionCache

    from . import arcs, depth_filter, end_tangents, equal_chords, matching, second_best, skeleton_graph, thinning

    kernels = (
        arcs.solve_gap,
        depth_filter.count_agreeing_neighbors,
        end_tangents.end_tangents,
        equal_chords.lay_equal_chords,
        matching.settle_dominant_pairs,
        second_best.second_best_rise,
        skeleton_graph.trace_branches,
        thinning.link_neighbors,
        thinning.thin_voxels,
    )
    folders = [Path(FunctionCache(kernel.py_func).cache_path) for kernel in kernels]
    return all(
        any(folder.glob(f"{Path(kernel.py_func.__code__.co_filename).stem}.{kernel.py_func.__name__}-*.nbi"))
        for folder, kernel in zip(folders, kernels, strict=True)
    )
