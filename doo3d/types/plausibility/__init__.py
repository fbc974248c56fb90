"""Checks for input and results that are plausible but wrong: the unit of depth, the camera, the registration of color, lengths.

Every check returns sentences, none if nothing looks wrong. A sentence begins with `check the <topic>:`, states the evidence, and
ends with the remedy.
"""

from __future__ import annotations

from .frame_notes import METHOD, frame_notes, topic_of

__all__ = ["METHOD", "frame_notes", "topic_of"]
