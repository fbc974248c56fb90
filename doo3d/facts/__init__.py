"""What the stages ask of a frame's mask and depth, made once and read by all."""

from .frame_facts import FrameFacts, facts_of

__all__ = ["FrameFacts", "facts_of"]
