"""Results on disk: the folder of a run, the JSON file of a detection, the journal, and their readers."""

SUFFIXES = {"json": ".json", "jpg": ".jpg", "png": ".png"}
"""The suffixes of the files that a run writes for each frame, by their kind."""

PICTURES = ("jpg", "png")
"""The kinds that are pictures, of which a frame has one or none; the first is the usual one."""

STRANDS = ".strands.json"
"""The suffix of what the first pass of a sequence keeps of a frame besides."""

MANIFEST, CONFIG, JOURNAL = "manifest.json", "config.yaml", "progress.jsonl"
"""The names of the files that a run writes once."""
