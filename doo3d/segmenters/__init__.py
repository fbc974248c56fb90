"""Ways of telling the object from the rest: one file each, found by name in `stages/segment.py`."""
