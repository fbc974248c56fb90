"""Where strands cross in the view, and which of them is on top."""

from .crossings import crossings_of_chains, find_crossings

__all__ = ["crossings_of_chains", "find_crossings"]
