"""Write and read results on disk: the folder of a run, the JSON file of a detection, the journal."""

SUFFIXES = {"json": ".json", "jpg": ".jpg", "png": ".png", "instances": ".instances.png"}
"""Kind of file that a run writes for each frame -> its suffix."""

PICTURES = ("jpg", "png")
"""Kinds of files that are pictures, the default first; a frame has at most one picture."""

STRANDS = ".strands.json"
"""Suffix of the file in which the first pass of a sequence stores the strands of a frame."""

MANIFEST, CONFIG, JOURNAL = "manifest.json", "config.yaml", "progress.jsonl"
"""The names of the files that a run writes once."""
