"""Limits of time and memory that several steps share: beyond them a frame is refused or thinned, and the result says so."""

MAX_CELLS = 2_000_000
"""Pixels of a mask or voxels of a grid at most: thinning takes 150 bytes each. The object in a frame of 1280x720 has a tenth."""

MAX_SAMPLES = 50_000
"""Samples or segments of all strands of a frame at most: ten ropes of 10 m have a tenth of that; more take minutes."""

MAX_NEAR_PAIRS = MAX_CELLS
"""Pairs of segments near each other at most: FCL takes 1 to 5 us and 180 bytes for each. In a tangle a segment has under ten."""

AT_ONCE = 1 << 14
"""Rows that are computed at once: with 26 neighbors of a few numbers each they fit into the cache."""

MAX_BRANCHES = 3000
"""Branches of a skeleton at most that become paths, the longest; each takes 0.1 ms. A frame of an object has less than 100."""

FRAME_RATE = 30
"""Frames per second of captures without times: that of most video."""

MAX_AGE = FRAME_RATE
"""Frames for which a chain that is not found is remembered at its last position: a second of video."""

KEY_LIMIT = 2**61
"""Keys of the cells of a sparse grid are 64-bit; the box must have fewer cells than this."""
