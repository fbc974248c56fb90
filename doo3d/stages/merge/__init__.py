"""Which chain ends belong together (paper, section III-F)."""

from .decisions import Candidate, DroppedChain, Merged, MergeDecision
from .merge import merge

__all__ = ["Candidate", "DroppedChain", "MergeDecision", "Merged", "merge"]
