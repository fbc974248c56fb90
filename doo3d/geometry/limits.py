"""Limit time and memory: beyond it a frame is refused or thinned, with a note."""

MAX_CELLS = 2_000_000
"""Largest number of pixels of a mask or voxels of a grid: thinning takes 150 bytes each. The object in a frame of 1280x720 has
a tenth."""

MAX_SAMPLES = 50_000
"""Largest number of samples or segments of all strands of a frame: ten ropes of 10 m have a tenth of it; more take minutes."""

MAX_NEAR_PAIRS = MAX_CELLS
"""Largest number of pairs of near segments: FCL takes 1 to 5 us and 180 bytes for each. In a tangle a segment has less than
ten."""

AT_ONCE = 1 << 14
"""Number of rows that are computed at once: with 26 neighbors of a few numbers each they fit into the cache."""

MAX_BRANCHES = 3000
"""Largest number of branches of a skeleton that become paths, the longest ones; each takes 0.1 ms. A frame of an object has
less than 100."""

FRAME_RATE = 30
"""Frames per second of captures without times: the rate of most video."""

MAX_AGE = FRAME_RATE
"""Number of frames for which a lost chain is remembered at its last position: a second of video."""

KEY_LIMIT = 2**61
"""Largest number of cells of a sparse grid: their keys are 64-bit."""
