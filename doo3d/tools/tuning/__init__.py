"""Proposal of a configuration from one frame: color ranges of the object, and the lengths that follow from its width."""

from .propose import Tuned, tune

__all__ = ["Tuned", "tune"]
