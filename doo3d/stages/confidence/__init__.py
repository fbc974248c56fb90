"""The confidence of chains: the odds that each is right, from every kind of evidence against it."""

from .confidence import TOLD, UNTOLD, UNTOLD_IMAGE, Evidence, with_confidence

__all__ = ["TOLD", "UNTOLD", "UNTOLD_IMAGE", "Evidence", "with_confidence"]
