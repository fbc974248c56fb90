"""What to set for a camera and an object: how to tell it by its colour, and the lengths that go with its width."""

from __future__ import annotations

from .propose import Tuned, tune

__all__ = ["Tuned", "tune"]
