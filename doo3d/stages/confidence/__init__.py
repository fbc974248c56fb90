"""The confidence of chains: the odds that each is right, from every kind of evidence against it."""

from .confidence import with_confidence
from .evidence import TOLD, UNTOLD, UNTOLD_CLOUD, UNTOLD_IMAGE, UNTOLD_NETWORK, Evidence
from .interpretations import USUAL, Interpretation, most_probable, other_interpretations

__all__ = [
    "TOLD",
    "UNTOLD",
    "UNTOLD_CLOUD",
    "UNTOLD_IMAGE",
    "UNTOLD_NETWORK",
    "USUAL",
    "Evidence",
    "Interpretation",
    "most_probable",
    "other_interpretations",
    "with_confidence",
]
