"""Which chain ends belong together (Keipour et al., RA-L 2022, section III-F)."""

from .decisions import TOO_MANY, DroppedChain, LinkCandidate, LinkDecision, Merged
from .links import merge

__all__ = ["TOO_MANY", "DroppedChain", "LinkCandidate", "LinkDecision", "Merged", "merge"]
