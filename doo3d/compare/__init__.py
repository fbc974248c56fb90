"""3-D against 2-D, frame by frame."""

from __future__ import annotations

from .agreement import Comparison, Place, compare, compare_chains
from .report import Record, compare_capture

__all__ = ["Comparison", "Place", "Record", "compare", "compare_capture", "compare_chains"]
