"""Hot loops on plain arrays, native: one C++ source file per kernel in `src/`.

Every function is checked in a test against a slow plain reference. Arrays are checked at the border: another data type, number of
axes or, for two axes and more, memory order than stated here is a TypeError; arrays that do not fit each other are a ValueError.
Arrays with one axis may have any stride; `coords` and the points of one polyline may have any layout; all others are in C
order.

The letters of shapes mean the same in all of them:

N points or pixels, P points of a polyline, D in {2, 3} coordinates, S samples along center lines, J joints, C chains, E = 2 C
ends of chains (end e is the first, even, or last, odd, of chain e // 2), M voxels, K pixels or voxels of a skeleton, B
branches, (H, W) rows and columns of an image. Lengths are in the unit of the coordinates: metres in 3-D, pixels in 2-D.
"""

from ..types import Array, Bools, Floats, Ints

def arc_length(points: Floats) -> Floats:
    """Return the length (P,) along a polyline (P, D) from its first point to each.

    8.6 times as fast as np.cumsum of np.linalg.norm of np.diff on 112 points (1.6 us against 13.7 us, 12 times a frame).
    """

def arc_line_arc(ends: Floats, radius: float, inside: bool) -> Floats:
    """Join two ends by an arc, a straight line and an arc of one radius.

    Parameters
    ----------
    ends
        (4, D) float64: an end, its outward unit direction, the other end, its outward unit direction
    radius
        of both arcs, in the unit of the ends
    inside
        bool, whether the arcs bend to the side where their targets are not

    Returns
    -------
    (A, 3 D + 2) float64, A in {0, 2}: start, direction, normal, angle, radius of the arc at either end, both pointing into the
    gap, with the line between the ends of the arcs; none if no path of this radius was found
    """

def arc_towards(start: Floats, direction: Floats, target: Floats, radius: float, opposite: bool) -> Floats:
    """Find the arc that leaves a point in a direction and ends pointing straight at a target.

    Parameters
    ----------
    start, direction, target
        (D,) float64; the direction is a unit vector
    radius
        of the arc, in the unit of the points
    opposite
        bool, whether the arc bends to the side where the target is not

    Returns
    -------
    (A, 3 D + 2) float64, A in {0, 1}: start, direction, normal, angle, radius; none if the target is inside the circle
    """

def connected_components(table: Ints) -> Ints:
    """Label the 26-connected components of voxels, in order of their first voxel.

    5.7 times as fast as scipy.sparse.csgraph.connected_components on 3,145 voxels (0.16 ms against 0.90 ms).

    table : (K, 26) int32 neighbors, -1 for none. Returns (K,) int64 component number.
    """

def corner_radius(ends: Floats) -> float:
    """Return the radius of the largest circle that touches both end lines ahead of the ends; -1 if they do not meet there.

    ends : (4, D) float64, as for `arc_line_arc`. Lines that are skew meet where they are closest.
    """

def count_agreeing_neighbors(
    depth: Array, mask: Bools, rows: Ints, columns: Ints, half_width: int, slope: float
) -> tuple[Ints, Ints, Floats]:
    """Count the neighbors of each depth reading that agree with it, and average them.

    A neighbor agrees if it differs by less than `slope` times its distance in pixels (the longer of the two sides).

    Parameters
    ----------
    depth
        (H, W) float32 m, 0 = none
    mask
        (H, W) bool, the pixels whose readings are compared
    rows, columns
        (N,) int64, the pixels of the readings
    half_width
        px, the window has 2 half_width + 1 rows and columns
    slope
        m per pixel

    Returns
    -------
    support : (N,) int64, neighbors that agree
    neighbors : (N,) int64, neighbors in the mask with a reading
    mean : (N,) float64 m, of the reading and the neighbors that agree
    """

def cover_with_chords(points: Floats, length: float) -> Floats:
    """Cover a curve with the whole number of chords of exactly `length` that fits best, centered on the curve.

    The chords are laid four times. The first time, from the curve's beginning, fixes their number. Each time the start is then
    moved by half of what the last joint is beyond the curve's end, or short of it, so that the excess is the same at both ends.

    points : (P, D) float64, the curve, extrapolated by `length` at both ends. Returns (J, D) float64 joints, J >= 2.
    """

def crossing_numbers(image: Array, rows: Ints, columns: Ints) -> Ints:
    """Count the lines that leave each pixel of a 2-D skeleton (Rutovitz' crossing number).

    Parameters
    ----------
    image
        (H, W) uint8, 1 on the skeleton; its outermost rows and columns are 0
    rows, columns
        (K,) int64, the pixels

    Returns
    -------
    (K,) int64: 1 at a tip, 2 along a line, 3 and more at a junction; 0 where the image is 0
    """

def end_tangents(joints: Floats, bounds: Ints, window: float) -> tuple[Floats, Floats]:
    """Return the outward tangent and the curvature vector at both ends of every chain.

    They are those of a parabola over arc length, fitted by least squares to the joints within `window` of the end (a line, for
    fewer than four joints): a line over a length of a curve of radius R lags behind its end by length / 2R. The fit is in
    polynomials orthogonal over the joints, which needs no system of equations: with t the arc length, 0 at the end, they are 1,
    t less its mean, and the square of that less its projections on the former two.

    Parameters
    ----------
    joints
        (J, D) float64, of all chains one after the other; each has at least two
    bounds
        (C + 1,) int64, where each chain begins in `joints`
    window
        the length of chain that is fitted, in the unit of the joints

    Returns
    -------
    tangents : (2 C, D) float64 unit vectors out of the chain, the first end of each chain and then its last
    curvatures : (2 C, D) float64, one over the unit of the joints, square to the tangents
    """

def first_clear(points: Floats, others: Floats, clearance: float) -> int:
    """Return the index of the first point that is farther than `clearance` from all others; the last index if none is.

    Parameters
    ----------
    points
        (P, D) float64
    others
        (N, D) float64; none: the first point is clear
    clearance
        in the unit of the points

    Returns
    -------
    int, 0 to P - 1
    """

def hysteresis(image: Array, low: float, high: float) -> Bools:
    """Select the pixels above a low threshold that are connected to a pixel above a high one.

    Pixels are neighbors along rows, columns and diagonals. Not-a-number is above nothing.

    Parameters
    ----------
    image
        (H, W) float32
    low, high
        in the unit of the image, rounded to float32; low <= high

    Returns
    -------
    (H, W) bool
    """

def is_simple(bits: int) -> bool:
    """Tell whether a voxel can be deleted without a change of the topology.

    bits : the neighborhood as a bit set: bit n is the neighbor at the n-th step of (-1, -1, -1) to (1, 1, 1) in lexicographic
    order, without (0, 0, 0).
    """

def lateral_sums(
    points: Floats, distance: Floats, index: Ints, samples: Floats, normals: Floats, reach: Floats
) -> tuple[Floats, Floats]:
    """Count the points of each sample and sum their lateral offsets.

    Parameters
    ----------
    points
        (N, 2) float64
    distance, index
        (N,) float64 and (N,) int64, of each point's nearest sample, as `nearest` returns them
    samples, normals
        (S, 2) float64, the samples, and the unit normal to the path at each
    reach
        (S,) float64, the distance from which a point does not count for its sample

    Returns
    -------
    count, total : (S,) float64 each; the offsets are signed along the normals
    """

def lay_equal_chords(points: Floats, length: float) -> tuple[Floats, Floats]:
    """Lay chords of exactly `length` along a polyline, the first from its first point.

    A chord ends where the polyline first leaves the sphere of radius `length` about the chord's start. The end is scaled to lie
    on the sphere exactly, so that rounding does not add up. What is left of the polyline after the last whole chord has no joint.

    Parameters
    ----------
    points
        (P, D) float64
    length
        in the unit of the points

    Returns
    -------
    joints : (J, D) float64, J >= 1
    arc_lengths : (J,) float64, the position of each joint along the polyline
    """

def match_by_subsets(weight: Floats) -> Ints:
    """Return a maximum-weight matching by dynamic programming over all subsets of the ends.

    The best total of a subset, a bit set, is that without its last end, or that of the last end with one of the others plus the
    best total without both. The pairs are then read back from the full set. Time and memory grow as 2^E.

    weight : (E, E) float64, symmetric, 0 where there is no pair. Returns (E,) int64, the end that each is paired with, -1 for
    none.
    """

def medial_axis(mask: Bools) -> tuple[Ints, Ints, Array]:
    """Return the pixels of a mask that are as far from its outside as their farthest neighbor, and that distance.

    All around the image is outside. The distance is the chamfer distance in two passes, down and up. Both keep no more than
    three rows, padded by two columns, and the distances at the pixels of the mask. On the way up a row is tested for maxima as
    soon as the row above it is final.

    1.6 times as fast as cv2.distanceTransform with cv2.dilate on the masks of rendered 1280x720 frames (median 0.24 ms against
    0.38 ms, at most 0.8 ms against 1.6 ms), whose distances also differ with and without Intel's IPP: these are the same on
    every machine.

    mask : (H, W) bool.

    Returns
    -------
    rows, columns : (K,) int64, from the lowest row up
    distance : (K,) float32 px, to the nearest pixel outside
    """

def moving_mean(points: Floats, half_width: int) -> Floats:
    """Return each point (P, D) as the mean of itself and `half_width` points on either side, fewer near the ends.

    By running sums: 10 times as fast as the same sums by np.cumsum on 79 points (1.5 us against 15.6 us).
    """

def nearest(points: Floats, targets: Floats, reach: float, limited: bool) -> tuple[Floats, Ints]:
    """Find the nearest target of each point; of several equally near the first.

    The targets are sorted into cells of edge `reach`. Points that follow each other in the list are often neighbors, as the
    pixels of a mask are, so up to MAX_GROUP of them that lie within reach / 5 of the first share its candidates: the targets in
    the cells around it, without those too far from the first to be the nearest of any (its nearest plus twice the slack). A
    point without a target within reach is compared with all targets, unless the search is limited. Ten times as fast as a k-d
    tree on the pixels of masks.

    Parameters
    ----------
    points
        (N, D) float64
    targets
        (S, D) float64, in the unit of the points
    reach
        the distance within which the search is quick
    limited
        bool, whether points without a target within reach are left out

    Returns
    -------
    distance : (N,) float64; infinite where a point was left out
    index : (N,) int64, of the nearest target; 0 where a point was left out
    """

def neighbor_table(coords: Ints) -> Ints:
    """Return the neighbor table of voxels.

    coords : (M, 3) int64 >= 1 in lexicographic order. Returns (M, 26) int32, indices into coords or -1.
    """

def points_near_line(
    points: Floats, origin: Floats, direction: Floats, half_edge: float, max_offset: float
) -> tuple[Floats, Floats, Floats]:
    """Select the points about an origin that lie near a line through it.

    Parameters
    ----------
    points
        (N, D) float64
    origin, direction
        (D,) float64, a point of the line, and its unit direction
    half_edge
        half the edge of the box about the origin in which points are taken
    max_offset
        the distance from the line below which points are taken

    Returns
    -------
    kept : (K, D) float64, those points
    along : (K,) float64, their positions along the line, 0 at the origin
    offset : (K,) float64, their distances from the line
    """

def prune_spurs(image: Array, rows: Ints, columns: Ints, min_length: float) -> None:
    """Remove the spurs of a 2-D skeleton in place, the shortest first.

    A spur is a line from a tip to a junction. Removing one may turn its junction into a part of a longer line, so the search
    begins anew after each. A line between two tips stays, however short it is.

    Parameters
    ----------
    image
        (H, W) uint8, 1 on the skeleton; its outermost rows and columns are 0. Changed in place
    rows, columns
        (K,) int64, the pixels of the skeleton
    min_length
        px, the length from which a spur stays
    """

def sample_bilinear(image: Array, positions: Floats) -> Floats:
    """Return the values of an image at positions between its pixels, by bilinear interpolation.

    5.5 times as fast as scipy.ndimage.map_coordinates on 20,000 positions in an RGB image. cv2.remap takes 1.5 times as long
    and rounds positions to 1/32 px.

    image : (H, W, C), any number type. positions : (N, 2) float64 px, (u, v). Returns (N, C) float64; NaN outside the image.
    """

def sample_gap(arcs: Floats, spacing: float) -> Floats:
    """Return points along an arc, a line and an arc, at most `spacing` apart on each, both ends included.

    arcs : (2, 3 D + 2) float64, as `solve_gap` returns them. spacing : in the unit of the arcs. Returns (P, D) float64, P >= 2.
    """

def second_best_rise(
    cost: Floats, partner: Ints, free_cost: float, free_partner: Ints, release: Floats, pairs: Ints, allow_closed: bool
) -> Floats:
    """Return the least rise of the total cost without each connection of a matching.

    Without the connection (a, b) either end stays free or goes to another end; the former partners of those stay free, go to a
    free end, or to each other. A lower bound of the rise is computed for every pair (c, d) that a and b may go to; the exchanges
    are then tried in order of their bounds until the bound exceeds the best rise so far.

    Parameters
    ----------
    cost, partner, free_cost, free_partner, release
        as above
    pairs
        (K, 2) int64, the connections
    allow_closed
        bool, whether an exchange may make a closed chain

    Returns
    -------
    (K,) float64, at most that of leaving both ends free
    """

def settle_dominant_pairs(weight: Floats) -> tuple[Ints, Ints]:
    """Pair the ends whose pair belongs to a maximum-weight matching whatever the rest of the matching is.

    A pair dominates if it weighs at least as much as the best other pair of its one end and the best other pair of its other end
    together: in a matching without it, it can replace those two. Without the ends of settled pairs more pairs dominate, so the
    search repeats until none is settled.

    weight : (E, E) float64, symmetric, 0 where there is no pair.

    Returns
    -------
    partner : (E,) int64, the end that each is paired with, -1 for none
    component : (E,) int64, the connected component of the unsettled ends to which each belongs, -1 for a settled end
    """

def sigma_filter(depth: Array, mask: Bools, rows: Ints, columns: Ints, half_width: int, max_difference: float) -> Floats:
    """Average each depth reading with the neighbors of similar depth (sigma filter: Lee, CVGIP 24, 1983).

    Parameters
    ----------
    depth
        (H, W) float32 m, 0 = none
    mask
        (H, W) bool, the pixels whose readings are averaged; holds the readings themselves
    rows, columns
        (N,) int64, the pixels of the readings
    half_width
        px, the window has 2 half_width + 1 rows and columns
    max_difference
        m, neighbors that differ by as much or more are left out

    Returns
    -------
    (N,) float64 m
    """

def solve_gap(ends: Floats, radius: float, max_deviation: float, inside: bool) -> tuple[bool, Floats]:
    """Return the arcs of the path across a gap: an arc, a straight line, an arc, tangent to both ends.

    The radius is that of `corner_radius` where the end lines meet ahead of both ends; elsewhere it is the given one, or the
    largest, up to half the gap, whose line keeps within `max_deviation`. A radius for which there is no path is made smaller in
    steps of sqrt 2 until there is one, and then larger again by bisection.

    Parameters
    ----------
    ends
        (4, D) float64: an end, its outward direction, the other end, its outward direction
    radius
        of the arcs where it is free, in the unit of the ends; 0 to choose it
    max_deviation
        rad, between the line and the straight connection of the ends, where the radius is chosen
    inside
        bool, whether ends that point away from each other are joined through the inside of the gap

    Returns
    -------
    touch : bool, whether the ends touch
    arcs : (A, 3 D + 2) float64, A in {0, 2}, as for `arc_line_arc`; none where only the straight connection is left
    """

def steps(points: Floats, closed: bool = False) -> Floats:
    """Return the distances between consecutive points (P, D): (P - 1,); (P,) where closed, with that from the last to the first.

    7 times as fast as np.linalg.norm of np.diff on the 61 points of a usual path (1.2 us against 8.2 us, 28 times a frame).
    """

def thin_pixels(coords: Ints) -> Bools:
    """Return which pixels of a mask are its skeleton, lines one pixel wide.

    Every pixel of the box has a code, its neighborhood as a bit set, which every deletion updates. A sub-iteration collects the
    pixels with a deletable code and then deletes them. A deleted pixel has the code 0, and so has one without neighbors, which
    stays; a pixel never loses its last neighbor. The two sub-iterations repeat until none deletes; a last pass takes the corners
    of staircases.

    coords : (N, 2) int64 >= 1 in lexicographic order. Returns (N,) bool.
    """

def thin_voxels(table: Ints) -> Bools:
    """Return which voxels are the curve skeleton (Lee-Kashyap-Chu thinning with sub-grids).

    In each of six directions collect the voxels that are exposed in that direction and may be deleted, then delete them in
    8 interleaved sub-grids, so that no two neighbors are tested one right after the other; each is checked again at its time.
    Deleting in index order would erode a strip from one end: each deletion would expose the next voxel. A voxel that was found
    not deletable is not tested again until one of its neighbors is deleted, which saves most of the tests.

    table : (M, 26) int32 as `link_neighbors` returns it. Returns (M,) bool.
    """

def trace_branches(table: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Trace the branches of a skeleton between its junctions.

    A voxel with more than two neighbors is a junction voxel; junction voxels that touch are one junction. Every other voxel has
    at most two neighbors, so it belongs to exactly one branch, and a branch is followed by stepping to the one neighbor that was
    not visited yet. The order of the starts makes that complete: first from every junction voxel into each of its neighbors,
    which gives all branches with a junction; then from the tips, which gives the branches with two free ends; what is left are
    closed loops. A branch that comes back to the junction it left ends beside a voxel of it, which the first step must not take
    for the end.

    Parameters
    ----------
    table
        (K, 26) int32 neighbors of each voxel, -1 for none

    Returns
    -------
    junction : (K,) int64, the junction that each voxel belongs to, -1 for none
    order : (V,) int64, the voxels of all branches one after the other, without junction voxels
    bounds : (B + 1,) int64, where each branch begins in `order`
    nodes : (B, 2) int64, the junctions at the start and at the end of each branch; -1 a free end; (-2, -2) a closed loop
    """

def traverse_contour(points: Floats, length: float, min_cosine: float) -> tuple[Floats, Ints]:
    """Lay chains of segments of equal length along points; a sharp turn ends a chain.

    The names are the paper's: p_s start of the current segment, p_c point being traversed, p_e its end, p_t the
    tip: the farthest point from p_s so far, from which a new chain starts after a sharp turn.

    Parameters
    ----------
    points
        (P, D) float64, P >= 1, no two in a row farther apart than `length`
    length
        of a segment, in the unit of the points
    min_cosine
        of the turn between two segments of a chain; a turn with a smaller cosine ends the chain

    Returns
    -------
    joints : (J, D) float64, of all chains one after the other
    bounds : (C + 1,) int64, where each chain begins in `joints`
    """

def unit(vector: Floats) -> Floats:
    """Return a vector (D,) scaled to length 1; a zero vector stays zero.

    3.1 times as fast as division by np.linalg.norm (0.6 us against 1.8 us), which differs in the last bit for 8 %.
    """

def unit_rows(vectors: Floats) -> Floats:
    """Return vectors (N, D) scaled to length 1; zero vectors stay zero.

    4.2 times as fast as division by np.linalg.norm on 613 rows (5.4 us against 22.9 us).
    """
