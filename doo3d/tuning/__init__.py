"""Proposals of a configuration for a camera and an object: color ranges, and the lengths that follow from its width."""

from __future__ import annotations

from .propose import Tuned, tune

__all__ = ["Tuned", "tune"]
