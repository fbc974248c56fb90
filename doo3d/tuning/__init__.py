"""Proposal of a configuration from one frame: color ranges of the object, and the lengths that follow from its width."""

from __future__ import annotations

from .propose import Tuned, tune

__all__ = ["Tuned", "tune"]
