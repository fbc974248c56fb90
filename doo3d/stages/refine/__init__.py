"""From the seen surface to the axis, the radius and equal segments."""

from .refine import refine

__all__ = ["refine"]
