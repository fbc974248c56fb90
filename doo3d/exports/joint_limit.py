"""Choose the number of segments of a robot's chains, for simulators that limit the number of joints."""

from collections.abc import Sequence

from .resampling import MIN_RING
from .trees import Grown

PYBULLET_JOINTS = 127
"""Greatest number of joints of a robot in PyBullet; it loads robots with more, but then cannot report the state of links."""

LENGTH_STEP = 1.02  # factor between lengths of segments that are tried until a robot has few enough joints


def joint_count(tree: Grown, counts: Sequence[int], axes: int) -> int:
    """Return the number of joints of a robot.

    Parameters
    ----------
    tree
        the chains; each has a fixed joint at its tip, and another at its base if it begins at the root.
    counts
        number of segments of each chain.
    axes
        number of revolute joints between two segments.
    """
    balls = sum(count - (parent is None) for count, parent in zip(counts, tree.parents, strict=True))
    return axes * balls + len(tree.children(None)) + len(counts)


def fitting_counts(tree: Grown, axes: int, limit: int | None) -> list[int]:
    """Return the number of segments of each chain, at most the detected one, with at most `limit` joints in all.

    All chains get segments of about equal length. If even one segment per chain exceeds the limit, each chain gets one segment.

    Parameters
    ----------
    tree
        the chains.
    axes
        number of revolute joints between two segments.
    limit
        greatest number of joints; None for no limit.
    """
    chains = tree.detection.chains
    detected = counts = [len(chain.occluded) for chain in chains]
    fewest = [min(MIN_RING if chain.closed else 1, count) for chain, count in zip(chains, detected, strict=True)]
    segment = max((chain.segment_length for chain in chains), default=0.0)
    while limit is not None and counts != fewest and joint_count(tree, counts, axes) > limit:
        segment *= LENGTH_STEP
        fitting = [int(chain.length / segment) for chain in chains]
        counts = [max(low, min(most, fit)) for low, most, fit in zip(fewest, detected, fitting, strict=True)]
    return counts
