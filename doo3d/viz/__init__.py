"""Pictures of what was found."""

from __future__ import annotations

from .overlay import draw

__all__ = ["draw"]
