"""Compare the 3-D mode with the 2-D mode, frame by frame."""

from .agreement import Comparison, Difference, compare, compare_chains
from .report import Record, compare_capture

__all__ = ["Comparison", "Difference", "Record", "compare", "compare_capture", "compare_chains"]
