"""Score the chains of one frame against the truth, by the strict rule of Keipour et al. (RA-L 2022) and all other metrics."""

from collections.abc import Sequence

from ...types import Camera, Chain, Crossing
from ..scenes.model import Truth
from . import connections, correct, crossings, nodes, occlusions
from .observed import Observed
from .record import TIME, Metric, Record

METRICS: tuple[Metric, ...] = (
    correct.METRIC,
    correct.IN_IMAGE,
    occlusions.METRIC,
    connections.METRIC,
    crossings.METRIC,
    nodes.METRIC,
)
"""The metrics of a frame, in the order of the columns. A new metric is one file and one line here."""

COLUMNS = (*(column for metric in METRICS for column in metric.columns), TIME)
"""The columns of the table of frames."""


def score(
    chains: Sequence[Chain],
    truths: Sequence[Truth],
    crossings: Sequence[Crossing] | None = None,
    camera: Camera | None = None,
) -> Record:
    """Score the chains of one frame against its true cables by all METRICS.

    Parameters
    ----------
    chains
        the detected chains, m, in the camera's optical frame. Their order and their directions do not matter, except that
        `crossings` refers to them by index.
    truths
        the true cables in the same frame; a cable whose `seen` is None counts as seen all along.
    crossings
        the detected crossings of the chains in the camera's image; None leaves crossings out of the score (all counts 0).
    camera
        the intrinsics, to score the chains in the image alone, too; None leaves this out.
    """
    observed = Observed(tuple(chains), tuple(truths), crossings, camera)
    return Record({name: value for metric in METRICS for name, value in metric.measure(observed).items()})
