"""Check input and results for values that are probably wrong: unit of depth, camera, registration of color, lengths.

Every check returns a list of sentences, which is empty if nothing looks wrong. A sentence begins with `check the <topic>:`,
states the evidence, and ends with the remedy.
"""

from .frame_notes import METHOD, frame_notes, topic_of

__all__ = ["METHOD", "frame_notes", "topic_of"]
