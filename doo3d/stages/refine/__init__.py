"""From the seen surface to the axis, the radius and equal segments: ends, center line, chains."""

from .refine import decide_viewpoint, estimate_centerline, extend_ends, lay_chains
from .samples import Samples

__all__ = ["Samples", "decide_viewpoint", "estimate_centerline", "extend_ends", "lay_chains"]
