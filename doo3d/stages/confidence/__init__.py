"""The confidence of chains: the odds that each is right, from every kind of evidence against it."""

from .confidence import with_confidence
from .evidence import TOLD, UNTOLD, UNTOLD_IMAGE, Evidence
from .interpretations import USUAL, Interpretation, most_probable, other_interpretations

__all__ = [
    "TOLD",
    "UNTOLD",
    "UNTOLD_IMAGE",
    "USUAL",
    "Evidence",
    "Interpretation",
    "most_probable",
    "other_interpretations",
    "with_confidence",
]
