"""Which chain ends belong together (Keipour et al., RA-L 2022, section III-F)."""

from .decisions import TOO_MANY, Candidate, DroppedChain, Merged, MergeDecision
from .links import merge

__all__ = ["TOO_MANY", "Candidate", "DroppedChain", "MergeDecision", "Merged", "merge"]
