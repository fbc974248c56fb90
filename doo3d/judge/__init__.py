"""The confidence of chains: the odds that each is right, from every kind of evidence against it."""

from .confidence import with_confidence
from .evidence import Evidence
from .interpretations import USUAL, Interpretation, most_probable, most_probable_chains, other_interpretations

__all__ = [
    "USUAL",
    "Evidence",
    "Interpretation",
    "most_probable",
    "most_probable_chains",
    "other_interpretations",
    "with_confidence",
]
