"""Find the occlusions of a true cable, and test whether a chain passes through them correctly."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from ...types import Chain, Floats
from ..scenes.model import Truth
from .alignment import ChainAlignment, Stretch, align_chain, axis_tolerance, hidden_runs
from .distances import sample_chain
from .observed import Observed
from .record import Metric, parts, share

MIN_OCCLUSION_LENGTH = 0.008
"""Length in m from which on a hidden run is an occlusion."""

MIN_SEEN_SIDE = 0.005
"""Length in m of the cable beyond an occlusion, on each side; with less, there is nothing to join."""

MIN_REACH = 0.0025
"""Length in m by which a chain must reach beyond both ends of an occlusion."""

SampleRun = tuple[int, int]
"""First and last axis sample of a hidden run."""


def occlusions(truth: Truth) -> list[SampleRun]:
    """Return the occlusions of a cable, as (first, last) indices of axis samples, both included.

    An occlusion is a stretch of at least 8 mm where the camera does not see the cable. At least 5 mm of an open cable must follow
    on both sides of it. On a closed cable, the indices may exceed the last one: take them modulo the number of axis samples.
    """
    side = 0 if truth.closed else int(np.ceil(MIN_SEEN_SIDE / truth.spacing))
    last_sample = np.inf if truth.closed else len(truth.axis) - 1 - side
    return [
        (first, last)
        for first, last in hidden_runs(truth)
        if (last - first + 1) * truth.spacing >= MIN_OCCLUSION_LENGTH and first >= side and last <= last_sample
    ]


def passed_occlusions(
    chains: tuple[Chain, ...], alignments: list[ChainAlignment], truths: tuple[Truth, ...], runs: Iterable[tuple[int, SampleRun]]
) -> int:
    """Return the number of occlusions through which at least one of the chains passes correctly.

    A chain passes correctly if it runs from one side of the hidden run to the other without a jump, and stays within the
    tolerance (see `axis_tolerance`) of the true axis in between.

    Parameters
    ----------
    chains
        the detected chains, joints in m, in the frame of the cables.
    alignments
        the alignment of each chain with the true cables, in the order of `chains`, from `align_chain`.
    truths
        the true cables.
    runs
        (index of the cable, (first, last)) for each occlusion, with first and last from `occlusions`.
    """
    aligned = list(zip(chains, alignments, strict=True))
    aligned += [(chain, align_chain(chain, truths)) for chain in map(_with_opposite_seam, chains) if chain]
    return sum(any(_passes(chain, alignment, truths[t], t, run) for chain, alignment in aligned) for t, run in runs)


def _with_opposite_seam(chain: Chain) -> Chain | None:
    """Return a closed chain with its first joint moved half-way around, to test an occlusion at its seam; None if open."""
    if not chain.closed:
        return None
    joints = np.roll(chain.joints[:-1], len(chain.joints) // 2, axis=0)
    none = np.zeros(0, dtype=bool)
    joints = np.vstack((joints, joints[:1]))
    return replace(chain, joints=joints, radii=np.zeros(0), occluded=none, depth_filled=none, deviations=None)


def _passes(chain: Chain, alignment: ChainAlignment, truth: Truth, cable: int, run: SampleRun) -> bool:
    """Return whether a stretch of the chain joins both sides of the hidden run and stays near the axis between them."""
    index = np.arange(run[0], run[1] + 1)
    start, end = index[0] * truth.spacing, index[-1] * truth.spacing
    for stretch in alignment.stretches:
        for turn in (-1, 0, 1) if truth.closed else (0,):
            low, high = start + turn * truth.length, end + turn * truth.length
            if stretch.cable == cable and stretch.arcs.min() <= low - MIN_REACH and stretch.arcs.max() >= high + MIN_REACH:
                return _stays_near(_points_between(chain, stretch, low, high), chain.segment_length, truth, run)
    return False


def _stays_near(points: Floats, segment_length: float, truth: Truth, run: SampleRun) -> bool:
    """Return whether points (Q, 3) m lie near the axis around a hidden run, and all of the axis there near the points."""
    index = np.arange(run[0], run[1] + 1) % len(truth.axis)
    sides = int(np.ceil(2 * segment_length / truth.spacing))
    around = np.arange(run[0] - sides, run[1] + sides + 1)
    around = around % len(truth.axis) if truth.closed else np.clip(around, 0, len(truth.axis) - 1)
    limit = float(axis_tolerance(truth)[index].max())
    from_points = cdist(points, truth.axis[around]).min(axis=1)
    from_axis = cdist(points, truth.axis[index]).min(axis=0)
    return bool(from_points.max() <= limit and from_axis.max() <= limit)


def _points_between(chain: Chain, stretch: Stretch, low: float, high: float) -> Floats:
    """Return points (Q, 3) m of the chain, from the last joint before arc `low` (m) to the first after arc `high` (m)."""
    rising = stretch.arcs[-1] >= stretch.arcs[0]
    arcs, joints = (stretch.arcs, stretch.joints) if rising else (stretch.arcs[::-1], stretch.joints[::-1])
    first = joints[max(int(np.argmax(arcs > low)) - 1, 0)]
    last = joints[min(len(arcs) - 1, len(arcs) - int(np.argmax(arcs[::-1] < high)))]
    return sample_chain(chain, min(first, last), max(first, last))[0]


def measure(match: Observed) -> dict[str, Any]:
    """Return the number of occlusions of all cables, and of those that a chain passes correctly."""
    runs = [(t, run) for t, truth in enumerate(match.truths) for run in occlusions(truth)]
    return {"occlusions": len(runs), "occlusions_correct": passed_occlusions(match.chains, match.alignments, match.truths, runs)}


METRIC = Metric(measure, (share(("occlusions", "correct"), 15, "occlusions", parts("occlusions", right="occlusions_correct")),))
