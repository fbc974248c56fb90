"""Results on disk: the folder of a run, the JSON file of a detection, the journal, and reading them back."""

from __future__ import annotations

SUFFIXES = {"json": ".json", "overlay": ".png"}
"""The files that a run writes for each frame."""
