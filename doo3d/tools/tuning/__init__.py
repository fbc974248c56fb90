"""Propose a configuration from one frame: color ranges of the object, and lengths derived from its width."""

from .propose import Tuned, tune

__all__ = ["Tuned", "tune"]
