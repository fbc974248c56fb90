"""3-D against 2-D, frame by frame."""

from __future__ import annotations

from .frames import Comparison, Place, compare, compare_chains
from .run import Record, compare_capture

__all__ = ["Comparison", "Place", "Record", "compare", "compare_capture", "compare_chains"]
