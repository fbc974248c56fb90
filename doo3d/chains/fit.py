"""Lay chains of equal segments along paths: Algorithm 2 of Keipour et al. (RA-L 2022)."""

import math

from ..config import FitConfig
from ..errors import ConfigError
from ..geometry.curves import Curves
from ..geometry.limits import MAX_SAMPLES
from ..kernels import fit_chains
from ..types import Path
from ..types.stopwatch import timed


@timed("fit")
def fit(paths: list[Path], length: float, config: FitConfig) -> Curves:
    """Lay chains of segments of exactly `length` along paths (Keipour et al., RA-L 2022, Algorithm 2).

    A turn of more than `config.max_turn` degrees between two segments ends a chain; the next chain begins there. A closed path is
    followed once around, back to its first point. If that gives a single chain, the chain is marked closed; its last
    joint is normally less than a segment away from its first. Path points farther apart than a segment get points in between
    before chains are laid.

    Parameters
    ----------
    paths
        polylines along the skeleton, m (px in 2-D).
    length
        of the segments, m (px in 2-D).
    config
        section `fit` of the settings.

    Returns
    -------
    The joints of the chains, in the order of the paths and along each path; a path whose points all lie within a segment of its
    start gives none. What is left at the end of a path, less than a segment, is not covered.

    Raises
    ------
    ConfigError : the segments are so short that there would be more than `MAX_SAMPLES`.
    """
    lines = Curves.of([path.points for path in paths], [path.closed for path in paths])
    total = float(lines.lengths.sum())
    if not total <= MAX_SAMPLES * length:
        raise ConfigError(
            f"fit.segment_length: {length:g} would make {total / length:.0f} segments in this frame: give it in m, in 2-D in px, "
            "as long as a few radii",
            code="value-out-of-bounds",
        )
    return Curves(*fit_chains(lines.points, lines.bounds, lines.closed, length, math.cos(math.radians(config.max_turn))))
