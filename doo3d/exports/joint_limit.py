"""How many segments the chains of a robot may have, where a simulator limits its joints."""

from collections.abc import Sequence

from .resampling import MIN_RING
from .trees import Grown

PYBULLET_JOINTS = 127
"""Joints of a robot that PyBullet simulates: it loads one with more, and then cannot tell the state of any link."""

LENGTH_STEP = 1.02  # factor between lengths of segments that are tried until a robot has few enough joints


def joint_count(tree: Grown, counts: Sequence[int], axes: int) -> int:
    """Return the number of joints of a robot.

    Parameters
    ----------
    tree
        its chains; each has a fixed joint at its tip, and at its base if it begins at the root.
    counts
        number of segments of each chain.
    axes
        revolute joints between two segments.
    """
    balls = sum(count - (parent is None) for count, parent in zip(counts, tree.parents, strict=True))
    return axes * balls + len(tree.children(None)) + len(counts)


def fitting_counts(tree: Grown, axes: int, limit: int | None) -> list[int]:
    """Return the number of segments of each chain with which a robot has at most `limit` joints, at most as detected.

    All chains get segments of about one length. A robot of so many chains that not even one segment each fits gets these.

    Parameters
    ----------
    tree
        its chains.
    axes
        revolute joints between two segments.
    limit
        number of joints; None for no limit.
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
