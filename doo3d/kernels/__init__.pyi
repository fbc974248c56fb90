# Made by backend/stub.py from the comments and signatures in src/: change those, and make it anew (CONTRIBUTING.md).
"""Hot loops on plain arrays, native. Every function is checked in a test against a slow plain reference.

Arguments are not converted: an array of another data type, number of axes or, for two axes and more, memory order than stated is
a TypeError; arrays whose shapes do not fit each other are a ValueError. Arrays with one axis may have any stride; `coords` and
the points of one polyline may have any layout; all others are in C order. Results own their memory.

The letters of shapes mean the same in all kernels: N points or pixels, P points of a polyline, D in {2, 3} coordinates, S samples
along center lines, J joints, C chains, E = 2 C ends of chains (ends 2 c and 2 c + 1 are the first and the last end of chain c), M
voxels, K pixels or voxels of a skeleton, B branches, (H, W) rows and columns of an image. Lengths are in the unit of the
coordinates: metres in 3-D, pixels in 2-D.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..types import Array, Bools, Floats, Ints

class CloudFacts:
    """What the stages ask of the points of a cloud, made once from every k-th of its N points, the sample.

    Parameters
    ----------
    points
        (N, 3) float64 m, finite; they are not copied, and must not change
    sample_points, sample_seeds
        points of the sample at least, if there are so many, and seeds among them, around which the density is measured
    strand_spacings
        point spacings; parts of the cloud that are farther apart are strands
    min_strand_fraction, min_large_fraction
        fraction of the points that a strand has at least, and that all strands have together
    """

    def __init__(
        self,
        points: Floats,
        sample_points: int,
        sample_seeds: int,
        strand_spacings: float,
        min_strand_fraction: float,
        min_large_fraction: float,
    ) -> None: ...
    @property
    def spacing(self) -> float:
        """Typical distance between neighboring points of a surface in m, at least 1e-6; 1 mm for fewer than two points.

        It follows from the radius of the disc that holds a point's eight nearest neighbors.
        """

    @property
    def strands(self) -> NDArray[np.int64]:
        """Number, from 0, of the strand of each point of the sample, (S,), read-only; -1 in a small part; empty if all touch."""

    def without_outliers(self, cell_spacings: float, min_ratio: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Drop the points with few neighbors, and average each other point and its neighbors.

        Points are sorted into cubic cells. The neighbors of a point are all points in its cell and in the 26 cells around, the
        point itself included.

        Parameters
        ----------
        cell_spacings
            edge of a cell in point spacings
        min_ratio
            fraction of the median number of neighbors that a point has at least

        Returns
        -------
        points : (K, 3) m, the points kept; the array of the cloud itself if all are.
        means : (K, 3) m, for each point kept the mean of its neighbors; the points themselves if the cloud is too wide for such
            small cells.
        """

    def strands_nearer(self, distance: float) -> bool:
        """Tell whether two strands of the sample come nearer to each other than `distance` m; False if all touch."""

    def strand_of(self, points: Floats) -> NDArray[np.int64]:
        """Return the number of the strand that each of the points of the cloud, moved as it may be, is nearest to, (N,).

        points : (N, 3) float64 m, in the order of the points of the cloud. The strands lie where the points of the sample were
        moved to. If all touch, the number is 0.
        """

class ColorOdds:
    """The log-odds that a color is of an object and not of its surround, from two color histograms of 16 levels per channel.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB; it is not copied, and must not change.
    object, surround
        (N,) and (K,) int64, row-major indices of pixels of the object and of its surround.
    shades
        (S,) 0 to 1; the surround's colors in each of these shades, truncated to whole values, count too.
    shade_share
        the weight of a color in a shade; that of a color as seen is 1.
    smoothing
        cells, standard deviation of the Gaussian by which the histograms are smoothed along each axis; cells at the border are
        repeated.
    least
        frequency added to that of each cell, so that none is 0.
    """

    def __init__(
        self, color: Array, object: Ints, surround: Ints, shades: Floats, shade_share: float, smoothing: float, least: float
    ) -> None: ...
    @property
    def log_odds(self) -> NDArray[np.float32]:
        """The log-odds, (4096,) float32 nat, of the cells of colors: 16 levels per channel, the blue one last."""

    @property
    def separation(self) -> float:
        """The median, nat, of the log-odds over the pixels of the object; 0 without any."""

    def log_odds_at(self, pixels: Ints) -> NDArray[np.float64]:
        """Return the log-odds, (N,) nat, of the colors at pixels (N, 2) int64 (u, v) in the image: positive on the object."""

    def noise_at(self, pixels: Ints) -> NDArray[np.float64]:
        """Return the standard deviations, (N,) nat, of the log-odds at pixels (N, 2) int64 (u, v) in the image.

        They are sqrt(1/a + 1/b) for a and b pixels of object and surround in the smoothed cell of a color.
        """

class CrossingStrands:
    """Samples of the two strands at each of C crossings: S per strand, before and after the place where they overlap in the view.

    Positions and lengths in the view are in its unit: px for a camera and in 2-D, tangents of angles for a cloud with a
    viewpoint, m otherwise. Samples beyond the ends of a strand are NaN.

    Parameters
    ----------
    joints, bounds
        (J, 3) joints of the chains as (u, v, distance): position in the view and distance along the viewing direction, and bounds
        of the chains as for `polyline_lengths`
    closed
        (L,) bool, True for a ring, whose last joint repeats its first
    chain, segment, t, angle, point
        the crossings: (C, 2) int64 chain and segment of both strands, (C, 2) position along the segments from 0 to 1, (C,) rad
        between them in the view, (C, 2) position in the view
    radius, half_width
        (C, 2) radius of the strands, m (px in 2-D), and half their width in the view
    distances
        (S / 2,) half-widths beyond the overlap of the samples on one side
    margin
        half-lengths of the overlap that are left out
    min_angle
        rad; strands that cross at less are taken to cross at this
    """

    def __init__(
        self,
        joints: Floats,
        bounds: Ints,
        closed: Bools,
        chain: Ints,
        segment: Ints,
        t: Floats,
        angle: Floats,
        point: Floats,
        radius: Floats,
        half_width: Floats,
        distances: Floats,
        margin: float,
        min_angle: float,
    ) -> None: ...
    def positions(self, offsets: Floats) -> NDArray[np.float64]:
        """Return the positions in the view (C * 2 * S * A, 2), at lateral offsets (A,) half-widths from each sample."""

    def readings(self, offsets: Floats, depth: Floats, mask: Bools) -> NDArray[np.float64]:
        """Return the readings (C * 2 * S * A,) m of a depth image (H, W) float32 at `positions`; NaN outside the mask."""

    def depth_log_odds(self, surface: Floats, settings: Floats) -> NDArray[np.float64]:
        """Return the log odds that the first strand is upper, (C,) nat, by the chains' depth and that of their surfaces.

        The surface of each strand is measured on both sides of the overlap and extrapolated across the overlap by a parabola.
        Readings on a strand that differ by more than its thickness from its others belong to something else and are left out, and
        so are outliers of the parabola, once.

        Parameters
        ----------
        surface
            (C * 2 * S * A,) m, distance of the object's surface at `positions`; NaN without a reading
        settings
            (5,): deviations of an outlier; readings of a surface at least; standard deviation of a difference in depth in
            thicknesses, twice that without surfaces; weight of the surfaces beside the chains; thicknesses that count at most
        """

    def color_log_odds(self, image: Array, offsets: Floats, settings: Floats) -> NDArray[np.float64]:
        """Return the log odds that the first strand is upper, (C,) nat, by the colors in the overlap.

        The colors across the upper strand (bright middle, darker sides) continue through the overlap. So each strand's median
        colors on both sides are compared with the colors inside. With normally distributed errors of unknown size, the logarithm
        of the likelihood ratio of n independent colors is n / 2 times that of the ratio of the mean squared errors.

        Parameters
        ----------
        image
            (H, W, 3) uint8 RGB, looked up bilinearly
        offsets
            (A,) lateral offsets in half-widths
        settings
            (5,): samples on each side at least that are in the image, or the result is 0; deviation of colors; number of
            independent colors; logarithm of the ratio that tells nothing, and that counts at most
        """

class FrameFacts:
    """A mask as runs of pixels, without its small components and with its small holes filled, and the depth in it.

    Components are 8-connected, and the pixels of their holes count for their size too; holes are 4-connected, and the background
    that reaches the border of the image is none.

    Parameters
    ----------
    mask
        (H, W) bool
    depth
        (H, W) float32 m, 0 = no reading; None without depth
    min_pixels
        components and holes of fewer pixels are small
    """

    def __init__(self, mask: Bools, depth: Floats | None = None, min_pixels: int = 0) -> None: ...
    @property
    def selected(self) -> int:
        """Number of pixels before small components are removed and small holes are filled."""

    @property
    def removed(self) -> int:
        """Number of pixels of small components."""

    @property
    def filled(self) -> int:
        """Number of pixels of small holes."""

    @property
    def count(self) -> int:
        """Number N of pixels after small components are removed and small holes are filled."""

    @property
    def box(self) -> tuple[int, int, int, int]:
        """First row, row after the last, first column and column after the last that hold pixels; else four 0."""

    def image(self) -> NDArray[np.bool_]:
        """Return the mask (H, W) bool as a new array."""

    def pixel_list(self) -> NDArray[np.int64]:
        """Return the pixels (N, 2) int64 (u, v), sorted by u and then v."""

    def medial_axis(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
        """Return the pixels as far from the outside as their farthest neighbor, as the function `medial_axis` does.

        Returns (K,) int64 rows, (K,) int64 columns and (K,) float32 px, the distances.
        """

    def skeleton_pixels(self) -> NDArray[np.int64]:
        """Return the pixels (S, 2) int64 (u, v) that Zhang-Suen thinning leaves, in row-major order; see `thin_pixels`."""

    def closed_core(self, half_widths: Ints, distance: float) -> int:
        """Return the number of pixels farther than a distance from the outside once gaps are closed; see `close_mask`.

        half_widths : (K,) int64, half the widths of a symmetric shape, from its middle row on. distance : px.

        Raises
        ------
        ValueError : half_widths is empty or increases, or a value is negative or more than the image is large.
        """

    def lattice_pixels(self, most: int, golden: float) -> tuple[NDArray[np.float64], float]:
        """Return about `most` pixels of the mask, evenly distributed, as (u, v), sorted by u and then v.

        Parameters
        ----------
        most
            number of pixels, about; all are returned if there are not more
        golden
            the golden section, more than 1: of every `step` pixels of a row one is returned, shifted from row to row by about
            step / golden

        Returns
        -------
        (K, 2) float64 px, and the number of pixels of the mask that each stands for.
        """

    def core_pixels(self, pixels: Ints, reach: int, fraction: float, margin: float) -> NDArray[np.bool_]:
        """Tell which pixels lie in the core of a strand: as far from the edge as the largest such distance around, or nearly.

        Parameters
        ----------
        pixels
            (K, 2) int64, pixels (u, v)
        reach
            px, half-width of the square in which the largest distance is taken
        fraction, margin
            a pixel is in the core if its distance is at least `fraction` of the largest, or at most `margin` px less

        Returns
        -------
        (K,) bool, False for a pixel outside the mask
        """

    def middle_pixels(self, pixels: Ints, reach: float) -> NDArray[np.bool_]:
        """Tell which pixels (K, 2) int64 (u, v) are nearer to the skeleton than `reach` px, measured as by `near_mask`: (K,)."""

    def depth_summary(self) -> tuple[int, float, float]:
        """Return the number of depth readings, their median, and the median absolute difference of horizontal neighbors, m.

        Raises
        ------
        ValueError : there is no depth.
        """

    def inverse_depth_deviation(self, pixels: int) -> float:
        """Return the standard deviation of the inverse of the depth readings, 1/m, with that of their rounding.

        It is the larger noise of first and second differences along rows, whose larger quarter is left out, and the noise of
        rounding by the lower quartile of the steps between neighbors that differ: 1 / sqrt(12) of it. 0 if no two neighbors in a
        row differ.

        pixels : number of pixels, evenly drawn, that it is estimated from at least, where the mask has so many.

        Raises
        ------
        ValueError : there is no depth, or pixels is below 1.
        """

    def agreeing_readings(
        self, low: float, high: float, half_width: int, slope: float, median: float, min_agreeing: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], int]:
        """Find the depth readings with which enough of their neighbors in the mask agree, and average each with those.

        A neighbor at a distance of d pixels agrees if its depth differs by less than `slope` * d; d is the larger of the
        differences in row and column. A reading that lies farther beyond `median` than the nearest
        lies before it may differ in proportion to its distance, as those of a strand do that runs far away.

        Parameters
        ----------
        low, high
            m, the range of the readings that are tested; neighbors may lie outside
        half_width
            px; the window of neighbors has 2 half_width + 1 rows and columns
        slope
            m per pixel of distance
        median
            m from the camera, of the readings; to it the slope belongs
        min_agreeing
            neighbors that must agree, or half of those with a reading if that is less

        Returns
        -------
        pixels : (K, 2) int64 (u, v) of the K readings kept, in row-major order
        depth : (K,) m
        mean : (K,) m, of the reading and its neighbors that agree
        dropped : number of readings between `low` and `high` that were not kept

        Raises
        ------
        ValueError : there is no depth, or `half_width` is negative.
        """

    def depth_holes(self, kept: Ints, reach: int) -> NDArray[np.int64]:
        """Return the pixels in holes of the depth: farther than `reach` px from every kept reading, or as near to such.

        Parameters
        ----------
        kept
            (K, 2) int64, the pixels (u, v) whose readings were kept
        reach
            px, in rows or columns

        Returns
        -------
        (Q, 2) int64 (u, v), in row-major order; all are pixels of the mask without a reading

        Raises
        ------
        ValueError : there is no depth, or `reach` is negative.
        """

class MaskEdge:
    """The edge of a mask that moves, within a band around the mask, to where the colors of an image say that it is.

    Distances are chamfer distances of OpenCV (DIST_L2, 3 x 3). Work and memory follow the pixels of the bounding box of mask and
    ring at 1 bit each, and the colors of the band. Ten times as fast as OpenCV on arrays of the box (2.5 ms against 30 ms
    for three moves in a frame of 1280 x 720).

    Parameters
    ----------
    mask
        (H, W) bool.
    band_px, ring_px
        px, distances from the mask; the edge moves up to the first, and the surround is sampled up to the second, but not farther
        than this from the mask's bounding box along rows and columns.
    """

    def __init__(self, mask: Bools, band_px: float, ring_px: float) -> None: ...
    def inside(self) -> NDArray[np.int64]:
        """Return the pixels within the edge whose eight neighbors are too; all pixels within the edge if there are none.

        Returns (N,) int64, row-major indices in the whole image.
        """

    def around(self, most: int) -> NDArray[np.int64]:
        """Return pixels of the ring: at first those beyond the band, after a move all that do not touch the edge.

        most : number of pixels; of twice, three times ... as many only every second, third ... is returned. Returns (N,) int64,
        ascending row-major indices in the whole image.
        """

    def move(self, color: Array, log_odds: Floats, kernel: Floats) -> None:
        """Move the edge to where the smoothed log-odds of the colors are 0: pixels of the band above 0 are within.

        Parameters
        ----------
        color
            (H, W, 3) uint8 RGB.
        log_odds
            (4096,) float32, of each cell of colors, as `ColorOdds.log_odds` has them.
        kernel
            (2 R + 1,) float32, symmetric weights by which the log-odds are smoothed along rows and columns; at the border of the
            image they are mirrored.
        """

    def restore_parts(self, min_thickness: float, min_elongation: float) -> None:
        """Restore the connected parts of the mask, now beyond the edge, that are as thick and long as a cable.

        min_thickness : px, half-width that such a part exceeds. min_elongation : area that it exceeds, in squares of that.
        """

    def raggedness(self) -> float:
        """Return the number of pixels that the edge moved by more than 1 px, per pixel of the mask's edge; 0 without an edge."""

    def mask(self) -> NDArray[np.bool_]:
        """Return the pixels (H, W) bool within the edge."""

class VoxelCells:
    """The cells of a sparse grid that N points occupy, of which the voxels are made.

    The key of a cell is its row-major index in the box, which ends `margin` cells before the first and beyond the last point.

    Parameters
    ----------
    points
        (N, D) float64, D = 2 or 3, finite; they are not copied, and must not change
    size
        edge of a cell, in the unit of the points
    margin
        number of empty cells beside the points along each axis
    limit
        number of cells of the box at most, 9e18 at most
    """

    def __init__(self, points: Floats, size: float, margin: int, limit: float) -> None: ...
    @property
    def total(self) -> float:
        """Number of cells of the box; there are no `keys` if it is over the limit."""

    @property
    def keys(self) -> NDArray[np.int64]:
        """Keys of the M occupied cells, (M,) int64, ascending."""

    @property
    def shape(self) -> NDArray[np.int64]:
        """Number of cells of the box along each axis, (D,) int64."""

    @property
    def origin(self) -> NDArray[np.float64]:
        """Lower corner of the box, (D,), in the unit of the points."""

    def closed(self, iterations: int, part: Ints) -> NDArray[np.int64]:
        """Close holes: morphological closing with a cube of 2 iterations + 1 cells.

        Parameters
        ----------
        iterations
            dilations along each axis, followed by as many erosions, 0 to 1000 and less than the margin
        part
            (N,) int64 >= 0, number of the part of each point; each part is closed by itself. Empty closes all at once

        Returns
        -------
        (K,) int64 ascending, keys of the occupied cells after closing, with those that hold points among them
        """

    def voxels(
        self, keys: Ints, min_voxels: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[np.int32]]:
        """Return the voxels with given keys, without small components.

        Parameters
        ----------
        keys
            (K,) int64 ascending, keys of the voxels, with those of all occupied cells among them
        min_voxels
            26-connected components of fewer voxels are left out

        Returns
        -------
        coords : (V, D) int64, index of each voxel along each axis, in lexicographic order
        centroids : (V, D) float64, mean of the points in each voxel, added in their order; of voxels without points the mean
            centroid of their neighbors that hold points, or the center where none does
        counts : (V,) int64, number of points in each voxel
        table : (V, 26) int32, as `neighbor_table` returns it; in 2-D for voxels whose third coordinates are equal
        """

def axes_in_mask(
    points: Floats,
    bounds: Ints,
    closed: Bools,
    filled: Bools,
    radius: Floats,
    half: int,
    pixels: Floats,
    share: float,
    surface: Floats,
    camera: Floats,
    depth: Floats,
    mask: Bools,
    plane: Floats,
    beside: Floats,
    settings: Floats,
    iterations: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Estimate the axis and the radius of strands in a mask, and with a camera in depth, from samples on the seen surface.

    In each iteration `silhouette` gives the offset across the line of sight and the radius, whose median is that of the path. The
    surface points near the samples so moved give the depth, as `axis_depth` does. An axis measured inside a plane is raised to a
    radius over it where the plane is seen beside the strand. Each path is smoothed by `whittaker_smooth`.

    Parameters
    ----------
    points
        (S, D) float64 m in the camera's optical frame, in 2-D px, S samples along C paths
    bounds
        (C + 1,) int64, row of the first sample of each path, and S; a path has one sample at least
    closed, filled
        (C,) bool, True for a ring, and (S,) bool, True for a sample in a gap that was filled
    radius
        (S,) float64 m (px in 2-D), radius of the path of each sample so far
    half
        number of samples on either side, on the same path, whose pixels and points are pooled
    pixels, share
        (N, 2) float64 px, (u, v) of N pixels of the mask, and how many pixels each stands for
    surface
        (M, 3) float64 m, M surface points; not used in 2-D
    camera
        (4,) float64 px, fx, fy, cx, cy; (0,) in 2-D
    depth, mask
        (H, W) float32 m, 0 = no reading, and (H, W) bool, the pixels of the object; both for the plane alone
    plane
        (4,) float64, unit normal and height along it, m; (0,) if there is none
    beside
        (A,) float64 px beyond both sides of a strand at which the plane is read
    settings
        (17,) float64: radii up to which pixels and points belong to a sample; weight in a filled gap; relative difference of the
        radius that weighs 1 / e; weight of the path; radii over which it is smoothed; greatest strength; least weight where
        weights determine nothing, as a share; weight of depth; radii of noise up to which it has that weight; radii from the
        middle that measure depth; median residuals of an outlier; a deviation in median residuals; step along an axis whose
        projection tells its direction, m; least scale, px per m; radii of the plane within which the median of the readings
        beside is of it; radii below the plane down to which an axis is raised; samples by which a ring is continued over its seam
    iterations
        number of iterations, 0 to 1000

    Returns
    -------
    (S, D) float64 m (px in 2-D), the samples on the axes; (S,) radius of their paths; (S,) radius at each.

    Raises
    ------
    ValueError
        If a sample lies behind the camera.
    """

def axis_depth(
    sample: Ints,
    lateral: Floats,
    depth: Floats,
    path: Ints,
    radius: Floats,
    half: int,
    central_part: float,
    outlier_medians: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Average how far behind each sample the axis of the object lies, over the surface points near it.

    A point with the lateral offset u and the depth offset w tells w + sqrt(r^2 - u^2), where r is the radius.

    Parameters
    ----------
    sample
        (N,) int64, index of the sample in whose cross-section each of N points lies
    lateral, depth
        (N,) float64 m, offsets of each point from its sample across the line of sight and along it
    path
        (S,) int64, number of the path that each of S samples lies on; the samples of one path are consecutive
    radius
        (S,) float64 m, radius of the object at each sample
    half
        number of samples on either side, on the same path, whose points are pooled
    central_part
        radii from the middle within which points count
    outlier_medians
        medians of the absolute residual beyond which a point is left out of the second average

    Returns
    -------
    mean : (S,) float64 m, positive away from the sensor; 0 where there are no points
    count : (S,) float64, number of points in each mean
    """

def blend_layer(picture: Array, layer: Array) -> None:
    """Blend a transparent layer over a picture in place.

    Parameters
    ----------
    picture
        (H, W, 3) uint8 RGB. Changed in place
    layer
        (H, W, 4) uint8 RGBA, the colors premultiplied by the opacity
    """

def bounding_box(mask: Bools) -> tuple[int, int, int, int]:
    """Return the first row, the row after the last, the first column and the column after the last that hold True; else four 0.

    mask : (H, W) bool.
    """

def carry_hidden(joints: Floats, seen: Bools, segment: float) -> NDArray[np.float64]:
    """Return the joints of an object in successive frames, with those that a frame hides carried from other frames.

    A hidden joint between seen ones is where it was seen last, moved since as the joints beside it that both frames show: turned
    together (Horn, J. Opt. Soc. Am. A 4, 1987), and by what they moved besides, in between linearly. The same from when it is
    seen next, and the mean of both by how near they are in time. So an error of one place stays there.

    Hidden joints that go on to an end of the object are laid along segments from the seen joint beside them, whose directions are
    found in the same way: that keeps their length, which the mean of positions does not, and nothing beyond tells it.

    Joints that are never seen keep their shape, and all joints of a frame that shows none of those of another.

    Parameters
    ----------
    joints
        (T, J, 3) float64 m, the joints of T frames
    seen
        (T, J) bool
    segment
        m, length of a segment: as if points so far off along each axis had not turned

    Returns
    -------
    (T, J, 3) float64 m
    """

def classify_positions(
    points: Floats, camera: Floats, depth: Floats, mask: Bools, margin: float, own_counts: bool, noise: float
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Tell what a depth image says about positions in space, each compared with the reading at the pixel that it projects to.

    Parameters
    ----------
    points
        (N, 3) float64 m in the camera's optical frame, or (N, 2) px in 2-D
    camera
        (4,) float64, the intrinsics fx, fy, cx, cy in px; (0,) in 2-D, where positions in the mask are 3, and others 5
    depth, mask
        (H, W) float32 m, 0 = no reading, not used in 2-D, and (H, W) bool, the object
    margin
        m by which a reading is behind a position to show that it is free, or in front of it to hide it
    own_counts
        True if a reading in the mask also shows that a position in front of it is free
    noise
        1/m, standard deviation of the readings in inverse depth, above 0

    Returns
    -------
    class : (N,) int64: 0 outside the image, 1 no reading outside the mask, 2 no reading in the mask, 3 surface of the object,
        4 hidden, 5 free
    log_odds : (N, 3) nat, of the last three; minus infinity where the mask excludes one, 0 where there is no reading
    behind : (K,) int64, the hidden positions outside the mask whose reading is not nearer by the margin
    pixels, readings : (K, 2) int64, the pixel (u, v) of each of these, and (K,) float64 m, the reading there
    """

def close_mask(mask: Bools, half_widths: Ints, distance: float) -> tuple[NDArray[np.bool_], int]:
    """Close the gaps of a mask: dilation and then erosion with a symmetric convex shape; nothing is added at the border.

    Parameters
    ----------
    mask
        (H, W) bool
    half_widths
        (R,) half the widths of the shape, px, in its middle row and in the rows above and below; they do not increase
    distance
        px

    Returns
    -------
    closed : (H, W) bool
    deep : number of its pixels farther than `distance` from its outside, by the chamfer distance of `medial_axis`
    """

def color_bands(
    color: Array, around: Floats, deviation: Floats, seeds: Bools, beside: Bools, reach: int, min_pixels: int, limits: Floats
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_], NDArray[np.int64]]:
    """Return the bands of an image that differ in color from the surface around them, and pixels beside them that do not.

    The image, in CIELAB blurred by a Gaussian of 0.8 px, is evaluated in tiles of 8 px, only at the seeds and on from there as
    far as it differs. A pixel differs whose contrast is above a threshold, and that is no shadow: darker, without another color.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB.
    around
        (h, w, 3) float32, the surface's color in OpenCV's 8-bit CIELAB, of a smaller image.
    deviation
        (3,) over 0, deviations of the surface's color: the unit of contrast.
    seeds
        (r, c) bool, the pixels of a smaller image at which bands are looked for.
    beside
        (H, W) bool; tiles with such pixels beside those with bands are evaluated too.
    reach
        px from a tile with bands within which pixels of `beside` are looked at.
    min_pixels
        pixels of a band below which its widths are not measured.
    limits
        (5,) the contrast from which a pixel differs; the one that a band's share of pixels, limits[2], has at least; the share of
        lightness that a shadow leaves at least; the share of the contrast within 2 px that a band's edge has at least.

    Returns
    -------
    pixels, starts, half_widths, holds : the 8-connected bands without their faint edges, as `mask_parts` returns parts; all of
        `holds` are False.
    surface : (N,) row-major indices of the pixels of `beside`, in tiles within `reach` of a band's, that do not differ; those in
        tiles that were not evaluated count as such.
    """

def crossing_numbers(image: Array, rows: Ints, columns: Ints) -> NDArray[np.int64]:
    """Count the lines that leave each pixel of a 2-D skeleton (Rutovitz' crossing number).

    Parameters
    ----------
    image
        (H, W) uint8, 1 on the skeleton; its outermost rows and columns are 0
    rows, columns
        (K,) int64, the K pixels to count at

    Returns
    -------
    (K,) int64: 1 at a tip, 2 along a line, 3 and more at a junction; 0 for an isolated pixel, and where the image is 0.
    """

def depth_support(
    joints: Floats,
    bounds: Ints,
    radius: Floats,
    depth: Floats,
    mask: Bools,
    camera: Floats,
    plane: Floats,
    positions: Floats,
    lateral: Floats,
    settings: Floats,
    min_readings: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Compare the segments of chains with the depth readings in the mask beside them.

    Parameters
    ----------
    joints
        (J, 3) float64 m in the camera's optical frame, the joints of C chains, one chain after the other
    bounds
        (C + 1,) int64; the joints of chain c are joints[bounds[c]:bounds[c + 1]], the last entry is J
    radius
        (C,) float64 m, radius of each chain
    depth, mask
        (H, W) float32 m, 0 = no reading, and (H, W) bool
    camera
        (4,) float64, the intrinsics fx, fy, cx, cy in px
    plane
        (4,) float64, unit normal and height along it, m, of the plane that chains may lie on; (0,) without one. A reading between
        a segment on it and the plane does not differ
    positions, lateral
        (P,) and (A,) float64: fractions of a segment's length, and radii to the side of its axis, at which readings are taken
    settings
        (5,) float64: radii by which the surface is nearer than the axis; least and most radii by which a reading may differ from
        the surface and agree; factor of the median difference of a chain's readings that may differ, between the two; radii over
        the plane below which an axis lies on it
    min_readings
        readings of a segment that make a median

    Returns
    -------
    supported, agreeing : (S,) float64 of S segments, the share of the P A readings of each that differ by less than the least,
        and by less than the chain's readings may; 0 for a segment behind the camera
    residual : (S,) float64 radii, absolute median difference of the readings of each; NaN with too few
    offset : (S,) float64 radii, by how much they lie behind the surface, median, whatever the plane explains; NaN with too few
    """

def end_tangents(joints: Floats, bounds: Ints, window: float) -> NDArray[np.float64]:
    """Return the outward tangent at both ends of every chain.

    Parameters
    ----------
    joints
        (J, D) float64, the joints of all C chains, one chain after the other; each chain has at least two
    bounds
        (C + 1,) int64; chain c is joints[bounds[c]:bounds[c + 1]], the last entry is J
    window
        length of chain at each end that is fitted, in the unit of the joints

    Returns
    -------
    (2 C, D) float64 unit vectors out of the chain; rows 2 c and 2 c + 1 are the first and the last end of chain c

    Notes
    -----
    They are the tangents of a parabola over arc length, fitted by least squares to the joints within `window` of the end; with
    fewer than four joints of a straight one. A line fitted over a length of a curve of radius R would lag behind its end by
    length / 2R. The fit uses polynomials orthogonal over the joints, which needs no system of equations.
    """

def equal_segments(
    points: Floats, bounds: Ints, closed: Bools, shifts: Floats, length: float, most_samples: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Lay chains of segments of exactly `length` along polylines, each from end to end.

    The whole number of segments that fits best is used. A chain is longer or shorter than its polyline by the same length at
    both ends; where it is longer, it continues straight.

    Parameters
    ----------
    points
        (P, D) float64, the points of L polylines, one polyline after the other
    bounds
        (L + 1,) int64, row of the first point of each polyline; the last entry is P
    closed
        (L,) bool, True for a ring, along which no chain is laid
    shifts
        (2 L,) float64, length by which each polyline is lengthened straight ahead at its first and at its last point first;
        negative shortens it, the segment at the other end always stays
    length
        length of a segment, in the unit of the points
    most_samples
        0 lays chords on the polyline itself, inside of its bends. Otherwise the points, evenly spaced, are moved outwards first:
        by length^2 / 12 R at a bend of radius R, two thirds of the sagitta of a chord, at most length / 24. Where more points
        than this lie on a chord, bends are taken from points a quarter of a chord apart

    Returns
    -------
    joints : (J, D) float64, the joints of all chains, one chain after the other
    bounds : (L + 1,) int64, row of the first joint of each chain; none for a ring and where a polyline is shorter than half a
        segment or curled up within one
    """

def equalize_lengths(joints: Floats, length: float, mobility: Floats, rounds: int, tolerance: float) -> NDArray[np.float64]:
    """Return joints moved so that neighbors are about `length` apart (Mueller et al., "Position based dynamics", 2007).

    Parameters
    ----------
    joints
        (J, D) float64, m
    length
        distance that neighbors are to have, m
    mobility
        (J,) float64, how far each joint gives way, relative to the others; 0 for a joint that stays
    rounds
        times at most that all segments are brought to their length
    tolerance
        share of `length` by which the worst segment may differ from it

    Returns
    -------
    (J, D) float64, m.
    """

def exact_lengths(joints: Floats, length: float, rounds: int, tolerance: float) -> NDArray[np.float64]:
    """Return joints moved until neighbors are exactly `length` apart.

    Each step of Newton's method is the least, in the sum of squares, that makes them so to first order.

    Parameters
    ----------
    joints
        (J, D) float64, m
    length
        distance that neighbors are to have, m
    rounds
        steps of Newton's method at most
    tolerance
        share of `length` by which the worst segment may differ from it before all are scaled to it, in their directions

    Returns
    -------
    (J, D) float64, m.
    """

def fill_cells(
    points: Floats, centers: Floats, reach: float, counts: Ints, origins: Floats, axes: Floats, edge: float, cells: float
) -> NDArray[np.bool_]:
    """Tell whether the points within `reach` of each center, projected to a plane, occupy more than so many square cells of it.

    Parameters
    ----------
    points, centers, reach
        as for `neighborhood_spreads`
    counts
        (S,) int64, number of points within reach of each center
    origins
        (S, 3) float64, offset from each center to a corner of the cells, at most 10 times `reach` along each axis
    axes
        (S, 6) float64, two perpendicular unit vectors that span each plane, one after the other
    edge
        edge of a cell, in the unit of the points, over 0
    cells
        number of cells, not negative

    Returns
    -------
    (S,) bool
    """

def fit_chains(
    points: Floats, bounds: Ints, closed: Bools, length: float, min_cosine: float
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    """Lay chains of segments of equal length along polylines; a sharp turn ends a chain.

    It is Algorithm 2 of Keipour et al. (RA-L 2022). After a sharp turn the next chain begins at the tip of the turn: the point
    that was farthest from the end of the last segment. Points farther apart than a segment get points in between first.

    Parameters
    ----------
    points
        (P, D) float64, the points of L polylines, one polyline after the other
    bounds
        (L + 1,) int64, row of the first point of each polyline; the last entry is P
    closed
        (L,) bool, True for a ring, which is followed back to its first point
    length
        length of a segment, in the unit of the points
    min_cosine
        cosine of the greatest turn allowed between two segments of a chain

    Returns
    -------
    joints : (J, D) float64, the J joints of all C chains, one chain after the other
    bounds : (C + 1,) int64, row of the first joint of each chain; the last entry is J. Each chain has at least two joints; there
        is none where the points do not reach over one segment
    closed : (C,) bool, True for the only chain of a ring
    """

def fit_circles(
    sample: Ints, lateral: Floats, depth: Floats, path: Ints, radius: Floats, half: int, steps: int, min_points: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Fit a circle to the points of each cross-section by least squares (Gauss-Newton, started from the fit of Kasa, 1976).

    Parameters
    ----------
    sample
        (N,) int64, index of the sample in whose cross-section each of N points lies
    lateral, depth
        (N,) float64 m, offsets of each point from its sample
    path
        (S,) int64, number of the path that each of S samples lies on; the samples of one path are consecutive
    radius
        (S,) float64 m, fixes the radius of the circles; (0,) fits the radius too
    half
        number of samples on either side, on the same path, whose points are pooled
    steps
        iterations of Gauss-Newton, 0 to 1000
    min_points
        points that a circle is fitted to at least

    Returns
    -------
    center : (S, 2) float64 m, lateral and depth offset of the circle's center; meaningless where the radius is NaN
    radius : (S,) float64 m; NaN where there are too few points
    count : (S,) float64, number of points, after pooling
    """

def fit_joints(
    expected: Floats, points: Floats, arcs: Floats, sights: Floats, segment: float, turn: float, place: float
) -> NDArray[np.float64]:
    """Return the joints of an object fitted to samples of strands, by regularized least squares.

    The displacements d of the expected joints minimize the squared distances of the samples from the object, plus |d''|^2,
    turn |d'|^2 and place |d|^2, with differences of neighbors for derivatives: first with the samples whose place is known, then
    with all. Of the others the offset along the sight does not count. Then the joints that no sample is near are spaced evenly.

    Parameters
    ----------
    expected
        (J, 3) float64 m, J >= 2
    points, arcs
        (N, 3) and (N,) float64 m, the samples, and the arc length of the object at each; those beyond an end count there
    sights
        (N, 3) float64 unit, direction in which the place of a sample is not known; 0 where it is known
    segment
        distance of neighboring joints, m
    turn, place
        weights, beside 1 for a sample and for second differences; of no samples, the joints are the expected ones

    Returns
    -------
    (J, 3) float64 m. A ValueError says if the weights do not determine it.
    """

def fit_lines(
    points: Floats,
    at: Floats,
    distance: Floats,
    index: Ints,
    scales: Floats,
    widths: Floats,
    min_points: Floats,
    candidates: int,
    max_spread_ratio: float,
) -> tuple[
    NDArray[np.bool_],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.int64],
]:
    """Fit a straight line to the neighborhood of each of several points, at the least scale at which there is one.

    Lines towards some of the neighbors are tried; the best is fitted three times to the neighbors near it. There is a line if it
    has enough points, they spread little across it, and the point itself lies near it.

    Parameters
    ----------
    points
        (N, 3) float64 m
    at
        (S, 3) float64 m, points of these
    distance, index
        (S, K), K >= 2 nearest points of each, by ascending distance
    scales
        (L,) float64 m, ascending; half lengths of a line
    widths
        (L,) float64 m, distance from a line within which points belong to it, for each scale
    min_points
        (L,) float64, points that a line has at least, for each scale
    candidates
        neighbors towards which a line is tried
    max_spread_ratio
        variance across a line at most, as a fraction of that along it

    Returns
    -------
    found : (S,) bool
    center : (S, 3) float64 m, mean of the points of the line; the point itself without a line
    direction : (S, 3) float64 unit; 0 without a line, as all that follow
    across : (S,) float64 m, root mean square distance of the points from the line
    spacing : (S,) float64 m, mean distance of the points along the line
    scale : (S,) float64 m
    count : (S,) int64, number of points of the line
    """

def fit_plane(points: Floats, corners: Ints, distance: float, refinements: int) -> tuple[NDArray[np.float64], float]:
    """Fit the plane that has the most points near it, by planes tried and then least squares on the inliers.

    Parameters
    ----------
    points
        (N, 3) float64 m, at least one, of any layout
    corners
        (Q, 3) int64, rows of three points through which a plane is tried; the first of several with as many points near is taken
    distance
        m; a point nearer to a plane tried than this counts for it, one nearer than twice of it is an inlier of the fit
    refinements
        times at most that the plane is fitted to its inliers; it ends when these stay the same

    Returns
    -------
    normal : (3,) unit, of arbitrary sign.
    offset : m; points p on the plane have normal @ p = offset.

    If the corners of every plane are on one line, the result is the plane z = constant through the first point.
    """

def follow_ribbon(
    score: Floats,
    width: Array,
    color: Floats,
    taken: Array,
    angles: Floats,
    start: Floats,
    widths: Floats,
    turns: Floats,
    shifts: Floats,
    limits: Floats,
) -> NDArray[np.float64]:
    """Follow a strand along the ribbons of an image from a start in one direction, not counting the start.

    Each step takes the turn and the shift sideways with the best mean over three steps of the score less the cost of the color,
    less their own costs. Where the score is too low it goes straight on, up to a longest gap. The strand ends at the border,
    after a gap, and where it follows an earlier strand.

    Parameters
    ----------
    score
        (D, H, W) float32, in D directions over half a turn.
    width
        (D, H, W) uint8, the index in `widths` of the width with that score.
    color
        (H, W, 3) float32, CIELAB.
    taken, angles
        (H, W) uint8 and float32, non-zero on earlier strands, and their directions in radians.
    start
        (3,) x and y in px, within the image, and the direction in radians from x to y.
    widths
        (K,) px.
    turns, shifts
        radians and px that are tried at each step, the largest turn last.
    limits
        (14,) px of a step; costs of a px sideways, and of a change of the turn by the largest turn; difference of colors that
        costs the next but one number, and times that it costs at most; that cost; share that the strand's color keeps at a step;
        highest and lowest score; widths and px of a gap at most; radians below which an earlier strand is followed; samples on
        one at most; samples at most.

    Returns
    -------
    (P, 5) x, y, direction, running mean of the width, and score less the cost of the color, NaN where the strand is not seen; the
    last sample is seen.
    """

def follow_strand(
    image: Array,
    mask: Bools,
    joints: Floats,
    radius: float,
    max_length: float,
    tried: tuple[Floats, Floats, Floats, Floats],
    lookahead: int,
    numbers: Floats,
) -> NDArray[np.float64]:
    """Follow a strand in an image beyond the last joint of its chain, by the colors across the strand.

    A stretch that looks different, such as another strand on top, is skipped. The path ends where it runs into the mask, at the
    border of the image, after `max_length` radii, or where the colors no longer match. Colors are those of the nearest pixels,
    blurred by the weights 1, 2, 1 along rows and columns; only pixels that are asked for are blurred.

    Parameters
    ----------
    image
        (H, W, 3) uint8 RGB
    mask
        (H, W) bool, the pixels already known to be of the object
    joints
        (N, 2) px (u, v), N >= 2, the joints of the chain, in C order; the strand is followed beyond the last one
    radius, max_length
        px, radius of the strand; radii, length of the path at most
    tried
        (I,) radii across the strand at which its colors are read, and an even number of them for the background on both sides;
        (T,) radians, turns tried at a step, the largest one last; (S,) px, lateral shifts tried
    lookahead
        steps ahead that a step is judged by: the mean over them
    numbers
        (11,): radii of a step, 0.01 or more; radii before the end over which the strand's colors are measured, and over which its
        direction is; radii after which a path ends in the mask; radii of the strand that may look different; grey levels by which
        the colors of one strand differ anyway; squared color distance of the strand at most, in variances, and by how much that
        of the background exceeds it at least; share of the colors ahead taken over at a step; weights of contrast and turns

    Returns
    -------
    (P, 2) px, P points along the strand, beginning with the last joint; P = 1 if the strand does not continue

    Raises
    ------
    ValueError : shapes do not fit, a joint is not finite or two lie at the same place, or the radius is not positive.
    """

def gap_lengths(points: Floats, bounds: Ints, classes: Ints) -> NDArray[np.float64]:
    """Return how much of each polyline runs through free space or outside the image, unknown space, and over bare surface.

    Parameters
    ----------
    points, bounds
        (N, D) float64, the points of K polylines one after the other, and (K + 1,) int64, the first of each, and N
    classes
        (N - 1,) int64, the class of the middle between each point and the next, as of `classify_positions`, or 6, bare surface

    Returns
    -------
    (K, 3) float64, lengths in the unit of the points
    """

def gaps_along_lines(
    points: Floats,
    tangents: Floats,
    joints: Floats,
    bounds: Ints,
    closed: Bools,
    camera: Floats,
    radius: float,
    lines: Floats,
    line_bounds: Ints,
    reach: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Find the gaps between ends of chains along lines in the image.

    Two ends of different open chains that follow each other on one line are a gap if they are at least `reach` apart along it, if
    both point along it towards each other over that length, and if no other chain is within `reach` of the line between them.

    Parameters
    ----------
    points, tangents
        (2 C, 3) float64 m in the camera's optical frame, the ends of C chains, and unit vectors out of the chains
    joints, bounds, closed
        (N, 3) float64 m, the joints of the chains one after the other; (C + 1,) int64, the first of each, and N; (C,) bool, rings
    camera
        (4,) float64, the intrinsics fx, fy, cx, cy in px
    radius
        m, of the object
    lines, line_bounds
        (L, 2) float64 px, (u, v), points of lines one after the other, and int64, the first of each, and L
    reach
        px within which an end or a chain is on a line

    Returns
    -------
    pairs : (K, 2) int64, the two ends of each gap, in the order of the line
    points : (P, 3) float64 m, from the first end along the line to the second; inverse depth is interpolated
    bounds : (K + 1,) int64, the first point of each gap, and P
    """

def half_shell_spread(
    sample: Ints, lateral: Floats, path: Ints, half: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Measure how the points of each cross-section spread across the line of sight.

    Parameters
    ----------
    sample
        (N,) int64, index of the sample in whose cross-section each of N points lies
    lateral
        (N,) float64 m, lateral offset of each point from its sample
    path
        (S,) int64, number of the path that each of S samples lies on; the samples of one path are consecutive
    half
        number of samples on either side, on the same path, whose points are pooled

    Returns
    -------
    middle : (S,) float64 m, mean offset
    variance : (S,) float64 m^2
    count : (S,) float64, number of points, after pooling
    fourth : (N,) float64, fourth power of the offset of each point from the middle in standard deviations
    """

def hue_modes(hue: Ints, weight: Floats, bins: int, deviation: float, max_saddle: float) -> NDArray[np.int64]:
    """Return the number of the mode, from 1, of each bin of a histogram on a circle, (bins,) int64; 0 everywhere if it is empty.

    Modes are joined across their highest saddle until every saddle is low.

    Parameters
    ----------
    hue
        (N,) int64, bins
    weight
        (N,) float32, not below 0
    bins
        number of bins, at most 4096
    deviation
        bins, standard deviation of the Gaussian by which the histogram is smoothed
    max_saddle
        height of the saddle between two modes over that of the lower, up to which they are two
    """

def joint_deviations(
    joints: Floats,
    bounds: Ints,
    radius: Floats,
    radii: Floats,
    occluded: Bools,
    share: Floats,
    residual: Floats,
    offset: Floats,
    settings: Floats,
    weights: Floats,
) -> NDArray[np.float64]:
    """Return standard deviations of the joints of chains, roots of weighted sums of squared terms.

    The eight terms are pitch, noise, unsupported, residual, spread, bulge, roughness and hidden, in this order.

    Parameters
    ----------
    joints
        (J, 3) float64 m, the joints of C chains, one chain after the other
    bounds
        (C + 1,) int64; the joints of chain c are joints[bounds[c]:bounds[c + 1]], two at least; the last entry is J
    radius, radii
        (C,) and (J,) float64 m, radius of each chain and at each joint; NaN if unknown. Terms: by how much the one at the
        joint differs from the chain's (bulge); the root mean square of these (roughness)
    occluded
        (S,) bool of S segments. Term: length of chain from a joint to the nearest one beside a seen segment (hidden), of the
        whole chain if none is seen
    share, residual, offset
        (S,) float64, as of `depth_support`; (0,) without depth. Terms, each times the radius: 1 less the mean share of the two
        segments at a joint (unsupported), the greater residual of these, and the root mean square of the chain's offsets (spread)
    settings
        (5,) float64: pitch, m, and what a m of depth adds to it; standard deviation of inverse depth, 1/m, which times squared
        depth is the noise; most residual and offset that count, in radii, which stand for unknown ones
    weights
        (8, M) float64, of the terms in M kinds of deviation

    Returns
    -------
    (J, M) float64 m.
    """

def keep_segments(
    points: Floats, bounds: Ints, closed: Bools, pairs: Ints
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_], NDArray[np.float64]]:
    """Remove one of each two overlapping segments, that of the chain with fewer segments left, and return the rest as chains.

    Of chains of equal length the later one loses its segment. The first and the last segment of a ring share a joint and stay.

    Parameters
    ----------
    points
        (J, D) float64, the joints of all C chains, one chain after the other
    bounds
        (C + 1,) int64; chain c is points[bounds[c]:bounds[c + 1]], the last entry is J
    closed
        (C,) bool, True for a ring
    pairs
        (K, 2) int64, segments i < j that overlap, in the order in which one of them is removed; pairs that lost one are skipped

    Returns
    -------
    points, bounds, closed : the runs of segments that are left, as chains; a ring that lost a segment is open
    removed : (S, 2, D) float64, the joints of the removed segments, in the order of the segments
    """

def largest_within(values: Floats, wanted: Bools, half: Ints) -> NDArray[np.float32]:
    """Return the largest value in a window around each pixel that is wanted, as a dilation does.

    Parameters
    ----------
    values
        (H, W) float32
    wanted
        (H, W) bool, the pixels whose windows are searched
    half
        (R + 1,) int64, half the widths of the window's rows: of the middle row, and of those 1 to R above and below it

    Returns
    -------
    (H, W) float32; 0 where it is not wanted
    """

def lay_equal_chords(points: Floats, length: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lay chords of exactly `length` along a polyline, the first from its first point.

    A chord ends where the polyline first is farther than `length` from the chord's start. The rest of the polyline after the last
    whole chord has no joint.

    Parameters
    ----------
    points
        (P, D) float64, P >= 1
    length
        length of a chord, in the unit of the points

    Returns
    -------
    joints : (J, D) float64, the J >= 1 joints of the J - 1 chords; only the first point if the polyline is too short for a chord
    arc_lengths : (J,) float64, the position of each joint along the polyline, from its first point
    """

def least_near(points: Floats, positions: Floats, reach: float, most: int) -> NDArray[np.float64]:
    """Return the least value of the points of a plane near each of a few positions.

    Parameters
    ----------
    points
        (N, 3) float64, two finite coordinates and the value of each point; NaN tells nothing
    positions
        (P, 2) float64, in the unit of the coordinates
    reach
        distance within which a point is near
    most
        number of points that count, the nearest ones

    Returns
    -------
    (P,) float64; NaN where no point is near
    """

def line_ends(
    pixels: Ints, starts: Ints, shape: tuple[int, int], window: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the ends of lines one pixel wide: pixels with one pixel of a line among the eight around them.

    Parameters
    ----------
    pixels
        (N,) row-major indices of the lines' pixels, line by line, ascending in each
    starts
        (B + 1,) start of each line in `pixels`, and N
    shape
        (H, W) of the image
    window
        px; the direction of an end is that from the mean of its line's pixels within so many rows and columns

    Returns
    -------
    line : (E,) number of each end's line; in row-major order of the ends
    position : (E, 2) (row, column)
    direction : (E, 2) unit vector (row, column) out of the line; an end at the mean of its line has none and is left out
    """

def long_parts(mask: Bools, extent: int) -> NDArray[np.bool_]:
    """Return the 8-connected parts of a mask that extend over so many rows or columns at least.

    mask : (H, W) bool. extent : px. Returns (H, W) bool.
    """

def mask_parts(
    mask: Bools, min_pixels: int, asked: Ints
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the 8-connected parts of a mask, with their half-widths.

    Parameters
    ----------
    mask
        (H, W) bool.
    min_pixels
        pixels of a part below which its widths are not measured.
    asked
        (Q,) row-major indices of pixels; parts with one of them are not measured either.

    Returns
    -------
    pixels : (N,) row-major indices of the mask's pixels, part by part, ascending in each.
    starts : (K + 1,) where each of the K parts begins in `pixels`, and N.
    half_widths : (K, 2) px, distance from the middle to the edge, in the median and at the 85th percentile; 0 if not measured.
    holds : (K,) bool, the parts with pixels of `asked`.
    """

def mask_pixels(mask: Bools) -> NDArray[np.int64]:
    """Return the True pixels of a mask as (u, v) = (column, row), sorted by u and then v.

    mask : (H, W) bool. Returns (K, 2) int64 for K True pixels.
    """

def match_by_blossoms(weight: Floats, lowered: Callable[[Ints], tuple[Ints, Floats]] | None = None) -> NDArray[np.int64]:
    """Pair E chain ends so that the total weight of the pairs is largest (maximum-weight matching), each end in one pair at most.

    It is found by Edmonds' blossom algorithm, on the weights rounded to 2^-50 of the largest. Where weights are lowered, only the
    part of the matching that this changes is searched anew.

    Parameters
    ----------
    weight
        (E, E) float64, symmetric, the weight of pairing two ends; 0 for two ends that may not be paired
    lowered
        is called with the matching (E,), and returns pairs (K, 2) int64 of ends and their new weights (K,) float64; weights
        larger than before are ignored. The ends are then matched again, until it returns no pairs. None accepts the first
        matching

    Returns
    -------
    (E,) int64, the end that each is paired with; -1 for none.

    Raises
    ------
    ValueError : there are more than 5000 ends.
    """

def medial_axis(mask: Bools) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return the pixels of a mask that are as far from its edge as their farthest neighbor, and their distances.

    Everything outside the image counts as outside the mask. The distance is a chamfer distance, an approximation of the Euclidean
    distance by steps on a 5 x 5 neighborhood.

    Parameters
    ----------
    mask
        (H, W) bool

    Returns
    -------
    rows, columns : (K,) int64, the K pixels of the medial axis, from the bottom row of the image to the top
    distance : (K,) float32 px, from the center of the pixel to that of the nearest pixel outside the mask

    Notes
    -----
    1.6 times as fast as cv2.distanceTransform with cv2.dilate on the masks of rendered 1280x720 frames (median 0.24 ms against
    0.38 ms, at most 0.8 ms against 1.6 ms), whose distances also differ with and without Intel's IPP: these are the same on
    every machine.
    """

def middle_medians(values: Floats) -> NDArray[np.float64]:
    """Return the medians (A, C) of finite values (A, B, C) over the second axis, of at least one value, as NumPy takes them."""

def near_mask(mask: Bools, reach: float, inclusive: bool) -> NDArray[np.bool_]:
    """Return the pixels of an image that are nearer than `reach` px to a pixel of a mask, or as near.

    The distance is a chamfer distance by steps on a 5 x 5 neighborhood, as that of `medial_axis`.

    Parameters
    ----------
    mask
        (H, W) bool
    reach
        px
    inclusive
        whether a pixel at the distance `reach` is near

    Returns
    -------
    (H, W) bool; the pixels of the mask are near themselves
    """

def near_pixels(pixels: Ints, others: Ints, shape: tuple[int, int], square: int, diamond: int) -> NDArray[np.bool_]:
    """Tell which pixels (N,) lie in an octagon around one of the others: a square widened by a diamond.

    pixels, others : (N,) and (Q,) row-major indices in an image of a shape. square, diamond : px, half of the width of either.
    Returns (N,) bool.
    """

def nearest(points: Floats, targets: Floats, reach: float, limited: bool) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Find the nearest target of each point; of several equally near, the one with the lowest index.

    Parameters
    ----------
    points
        (N, D) float64, N points
    targets
        (S, D) float64, S targets, finite, in the unit of the points
    reach
        distance within which the search is quick, in the unit of the points, over 0
    limited
        True leaves out points without a target within `reach`; False compares them with all targets, which is slow

    Returns
    -------
    distance : (N,) float64; infinite for a point that was left out, and for all points if there are no targets
    index : (N,) int64, index of the nearest target; 0 where the distance is infinite

    Notes
    -----
    The points are sorted into cells, and each target competes for the points in the cells around it. Twenty times as fast as a
    k-d tree on the pixels of masks.
    """

def nearest_of_own(points: Floats, bounds: Ints, targets: Floats, target_bounds: Ints, reach: float) -> NDArray[np.int64]:
    """Return the index of the target nearest to each point, of the targets of the same path; of equally near ones the first.

    Parameters
    ----------
    points, targets
        (N, D) and (S, D) float64, points and targets of P paths, one path after the other
    bounds, target_bounds
        (P + 1,) int64; path p has points[bounds[p]:bounds[p + 1]], the last entry is N, and so for the targets
    reach
        distance within which most targets are found; it only sets the time taken

    Returns
    -------
    (N,) int64, rows of `targets`. Points that are not finite get the first target of their path.
    """

def nearest_points(points: Floats, positions: Floats, k: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Find the `k` points that are nearest to each of a few positions.

    Parameters
    ----------
    points
        (N, 3) float64, finite
    positions
        (S, 3) float64, finite, in the unit of the points
    k
        1 to N

    Returns
    -------
    distance : (S, k) float64, ascending
    index : (S, k) int64, index of each of these points; of equally near ones the first is first
    """

def neighbor_table(coords: Ints) -> NDArray[np.int32]:
    """Return the indices of the 26 neighbors of each voxel.

    coords : (M, 3) int64 >= 1, index of each of M voxels along the three axes, in lexicographic order. Returns (M, 26) int32:
    for each voxel, the row in `coords` of its neighbor at each offset from (-1, -1, -1) to (1, 1, 1) in lexicographic order
    without (0, 0, 0); -1 where there is no voxel.
    """

def neighborhood_spreads(
    points: Floats, centers: Floats, reach: float
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Measure how the points within `reach` of each of several centers spread.

    Parameters
    ----------
    points
        (N, 3) float64; points that are not finite are near nothing
    centers
        (S, 3) float64, finite, in the unit of the points
    reach
        greatest distance, in the unit of the points, over 0

    Returns
    -------
    counts : (S,) int64, number of points within reach of each center
    means : (S, 3) float64, their mean offset from the center; 0 where there are none
    covariances : (S, 9) float64, their covariance matrix, row by row; 0 where there are none
    """

def off_edge_share(mask: Bools, color: Array, reach: int) -> float:
    """Return the share of the edge of a mask at which the largest step of color across it lies elsewhere.

    Every (2 reach + 1)-th pixel of the edge is looked at, since nearer ones have the same colors across. The line across it leads
    away from the mask's pixels in a window of (2 reach + 1)^2, and has steps between neighboring pixels up to `reach` px to
    either side. The largest one lies elsewhere if it begins 2 px or more from the edge.

    Parameters
    ----------
    mask
        (H, W) bool.
    color
        (H, W, 3) uint8 RGB.
    reach
        px, 1 or more. Pixels nearer than twice this to the border of the image are left out.

    Returns
    -------
    0 to 1; 0 if no pixel is looked at.
    """

def paint_strokes(layer: Array, points: Floats, stops: Ints, colors: Array, blunt: Bools) -> None:
    """Draw antialiased strokes on a transparent layer in place, one after the other; each replaces what is below it.

    A stroke is a polyline with a half-width at each point, which changes linearly from one to the next; a single point is a disc.
    Pixel (column, row) has its center at (x, y) = (column, row), and is covered by the part of it that the stroke reaches across.

    Parameters
    ----------
    layer
        (H, W, 4) uint8 RGBA, the colors premultiplied by the opacity. Changed in place
    points
        (P, 3) px, the points of all strokes: x, y and half-width
    stops
        (S,) int64, the end of each of S strokes in `points`, exclusive; the first begins at 0, others where the last one ended
    colors
        (S, 4) uint8, the color of each stroke, premultiplied RGBA
    blunt
        (S,), whether a stroke is cut off at its first and its last point; otherwise its ends are round
    """

def part_medians(values: Floats, first: Ints, last: Ints) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the medians of parts of an array, without values that are not finite.

    Parameters
    ----------
    values
        (N,) float64
    first, last
        (K,) int64; part k is values[first[k]:last[k]]

    Returns
    -------
    median, deviation : (K,) float64, the median of each part, and the median of the absolute differences from it; NaN without
        values
    count : (K,) int64, number of finite values
    """

def percentiles(values: Floats, percents: Floats) -> NDArray[np.float64]:
    """Return percentiles (Q,) of the finite ones of values (N,), interpolated linearly as NumPy does; NaN without any.

    percents : (Q,) 0 to 100.
    """

def points_around(points: Floats, positions: Floats, reach: float) -> NDArray[np.int64]:
    """Return the points in the plane that may be within `reach` of one of several positions: all that are, and some farther away.

    Parameters
    ----------
    points
        (N, 2) float64; points that are not finite are near nothing
    positions
        (P, 2) float64, finite, in the unit of the points
    reach
        distance, in the unit of the points, over 0

    Returns
    -------
    (K,) int64, their indices, ascending; none is farther than 8 `reach` unless the positions spread over more than 64 `reach`
    """

def polyline_crossings(
    points: Floats, bounds: Ints, closed: Bools
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Find every place where two segments of L polylines in the plane cross. Neighbors, which share a point, do not count.

    Parameters
    ----------
    points, bounds
        the points of the polylines, (J, 2), as for `polyline_lengths`; segments with a point that is not finite are left out
    closed
        (L,) bool, True if the last point of a polyline repeats its first

    Returns
    -------
    line, segment : (C, 2) int64, polyline and segment of both segments at each of C crossings, in order of the first segment,
        then of the second
    t : (C, 2) float64, position of the crossing along each, from 0 to 1
    angle : (C,) float64 rad between the two, 0 to pi / 2
    point : (C, 2) float64, position of the crossing
    """

def project_pinhole(points: Floats, fx: float, fy: float, cx: float, cy: float) -> NDArray[np.float64]:
    """Return the pixels (N, 2) float64 (u, v) of points (N, 3) float64 m of any layout; NaN for those with z <= 0.

    A pixel is (fx x / z + cx, fy y / z + cy).
    """

def prune_spurs(image: Array, rows: Ints, columns: Ints, min_length: float) -> None:
    """Remove the spurs of a 2-D skeleton in place, the shortest first.

    A spur is a line from a tip to a junction. A line between two tips stays, however short it is. Without a spur its junction
    may be part of a longer line, so after each removal the spurs around it are measured anew.

    Parameters
    ----------
    image
        (H, W) uint8, 1 on the skeleton; its outermost rows and columns are 0. Changed in place
    rows, columns
        (K,) int64, the K pixels of the skeleton
    min_length
        px; spurs shorter than this are removed. A diagonal step counts as sqrt 2
    """

def raised_pixels(depth: Floats, along_u: Floats, along_v: Floats, offset: float, low: float, high: float) -> NDArray[np.bool_]:
    """Select the pixels raised from a plane towards the camera: hysteresis threshold of their height.

    A pixel of depth z lies offset - z (along_u + along_v) above the plane. Pixels higher than `high` are selected, and pixels
    higher than `low` that are connected to these by pixels higher than `low`, along rows, columns or diagonals.

    Parameters
    ----------
    depth
        (H, W) float32 m, 0 = no reading, which is never selected
    along_u, along_v
        (W,) and (H,) float32; their sum is the product of the plane's normal with the ray through the pixel, scaled to z = 1
    offset
        m; points p on the plane have normal @ p = offset, and the normal points away from the camera
    low, high
        m, the thresholds, low <= high

    Returns
    -------
    (H, W) bool
    """

def ribbon_scores(
    image: Floats, directions: int, widths: Floats, noise: float, length_widths: float, min_length: int
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Score how much each pixel looks like the middle of a ribbon in each direction.

    The score is the mean squared difference of a side's pixels from the ribbon's mean color, of the side that differs less,
    divided by the variance along the ribbon plus `noise`. The middle 0.7 of a ribbon's width counts as inside; a side begins a
    pixel beyond its edge and is a quarter as wide, 2 px at least. Pixels beyond the border repeat the outermost ones. Pixels and
    scores are interpolated between those of the image turned so that the ribbon is horizontal.

    Parameters
    ----------
    image
        (H, W, 3) float32, at least one pixel.
    directions
        number of directions D over half a turn, the first horizontal, the others from x to y.
    widths
        (K,) px, widths of ribbons, K from 1 to 255.
    noise
        squared unit of the image, over 0; variance that is noise.
    length_widths, min_length
        length of the window along a ribbon, in its widths, and in px at least.

    Returns
    -------
    score : (D, H, W) float32, of the width that scores most.
    width : (D, H, W) uint8, the index of that width.
    """

def sample_gap(arcs: Floats, spacing: float) -> NDArray[np.float64]:
    """Return points along a path of an arc, a line and an arc, at most `spacing` apart, from the first end to the second.

    Parameters
    ----------
    arcs
        (2, 3 D + 2) float64, the arcs at the two ends, as `solve_gap` returns them
    spacing
        greatest distance between neighboring points along the path, in the unit of the arcs

    Returns
    -------
    (P, D) float64, P >= 2 points; both ends of the path and both ends of its straight line are among them.
    """

def second_best_rise(
    cost: Floats, joined: Ints, joined_costs: Floats, free_cost: float, allow_closed: bool, alternatives: int
) -> NDArray[np.float64]:
    """Return, for each connection of a matching of chain ends, by how much the total cost rises at least if it is not made.

    The total cost is the sum of the costs of all connections, and `free_cost` / 2 for each end that stays free. Without the
    connection of ends a and b, each of the two stays free or is connected to another end; the former partners of those other
    ends stay free, are connected to a free end, or to each other.

    Parameters
    ----------
    cost
        (E, E) float64, cost of connecting any two of E ends; the lower of [i, j] and [j, i] counts, infinite where that is not
        allowed. Costs above `free_cost` are not allowed. Ends 2 c and 2 c + 1 belong to chain c
    joined, joined_costs
        (K, 2) int64 and (K,) float64, the two ends of each of K connections, and what it costs
    free_cost
        cost of leaving two ends free
    allow_closed
        True if an exchange of connections may close a chain to a ring
    alternatives
        number of other ends at most that each of the two ends is tried with, those with the least estimate of the cost; all E of
        them give the least rise

    Returns
    -------
    (K,) float64, at most `free_cost` less the cost of the connection; negative if the matching was not the best one.

    Notes
    -----
    A lower bound of the rise is computed for each pair of ends to which a and b may be connected; the exchanges are tried in
    order of their bounds until the bound exceeds the best rise so far.
    """

def section_axes(positions: Floats, tangents: Floats, viewpoint: Floats) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two unit axes across the object at each sample: across the line of sight, and away from the sensor.

    Parameters
    ----------
    positions
        (S, 3) float64 m
    tangents
        (S, 3) float64 unit, along the object
    viewpoint
        (3,) float64 m, position of the sensor; (0,) if unknown: the axes then turn as little as they can from sample to sample

    Returns
    -------
    lateral : (S, 3) float64; arbitrary where the object points at the sensor
    depth : (S, 3) float64, tangent x lateral
    """

def section_offsets(
    points: Floats, distance: Floats, index: Ints, positions: Floats, lateral: Floats, depth: Floats, reach: Floats
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the offsets of points from their nearest samples, across the line of sight and along it.

    Parameters
    ----------
    points
        (N, 3) float64 m, N surface points
    distance, index
        (N,) float64 and (N,) int64, distance and index of each point's nearest sample, as `nearest` returns them
    positions, lateral, depth
        (S, 3) float64, S samples along the object, m, and two unit axes of the cross-section at each
    reach
        (S,) float64 m; points that are not nearer than this to their sample are left out

    Returns
    -------
    sample : (K,) int64, the sample of each of the K points that are left
    u, w : (K,) float64 m, their offsets from the sample along its lateral and its depth axis
    """

def shift_costs(first: Floats, second: Floats, counts: tuple[int, int], limit: float) -> tuple[float, float]:
    """Return the cost of matching a polyline with another at the best shift along it, and with the other turned around.

    The polylines are compared at evenly spaced points, which are shifted by whole points against each other and overlap by at
    least half of the fewer. The cost is the mean of their distances over `limit`; a point without a counterpart counts 1/2.

    Parameters
    ----------
    first, second
        (P, D) and (Q, D) float64, P, Q >= 2, of any layout
    counts
        number of points at which each of the two is compared, 2 to 10000
    limit
        greatest distance, in the unit of the points; both costs are infinite if a gap between the boxes around the polylines is
        larger
    """

def silhouette(
    positions: Floats,
    tangents: Floats,
    lateral: Floats,
    path: Ints,
    pixels: Floats,
    share: float,
    camera: Floats,
    reach: Floats,
    half: int,
    step: float,
    min_scale: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Measure the middle and half the width of a mask at samples along paths, across the paths.

    Every pixel belongs to the sample that is nearest in the image. The number of pixels of a sample and of its neighbors over
    their length in the image is the width; the mean of the pixels' lateral offsets is the middle.

    Parameters
    ----------
    positions, tangents, lateral
        (S, 3) float64, S samples m in the camera's optical frame, and two unit axes at each: along the path, and across it;
        (S, 2) px without a camera
    path
        (S,) int64, number of the path of each sample; the samples of a path are consecutive
    pixels, share
        (N, 2) float64 px (u, v), and the number of pixels of the mask that each stands for
    camera
        (4,) float64, the intrinsics fx, fy, cx, cy in px; (0,) if positions are px
    reach
        (S,) float64 m (px without a camera); pixels that are not nearer than this to their sample are left out
    half
        number of samples on either side, on the same path, whose pixels are pooled with those of a sample
    step, min_scale
        m along an axis whose projection tells the axis's direction and scale in the image; px per m of an axis at least

    Returns
    -------
    offset : (S,) float64 m (px), from the sample to the middle of the mask along the lateral axis; 0 without pixels
    radius : (S,) float64 m (px), half the width; 0 without pixels. A ValueError says if a sample lies behind the camera
    """

def skeleton_paths(
    table: Ints,
    points: Floats,
    window_half: int,
    least: Floats,
    trim: Floats,
    shares: Floats,
    half_widths: Floats,
    origin: Floats,
    corner_widths: float,
    most_branches: int,
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_], NDArray[np.float64], int]:
    """Return smooth paths along the branches of a skeleton, without spurs and small loops, cut where strands touch.

    The branches are those of `trace_branches`; a node is in the middle of the voxels of a junction. Spurs and small loops are
    removed, the shortest first; a node left with fewer than three branches becomes a point of one branch. Last, a short branch
    between two forks is contracted: thinning makes such a pair of a crossing. A free end is cut by a length; so is an end at a
    node, and on until it is clear of every other branch there.

    Parameters
    ----------
    table
        (K, 26) int32 as `neighbor_table` returns it
    points
        (K, D) float64, D = 2 or 3, position of each voxel
    window_half
        number of points on either side that are averaged with each point of a path; fewer near the ends of an open path
    least
        (3,) float64 lengths: shorter branches with one free end are spurs; loops of less perimeter are small; shorter branches
        between two nodes are contracted
    trim
        (3,) float64: length cut at least; length at most within which an end at a node becomes clear of the others; distance from
        which on it is
    shares
        (2,) float64, share of the length of a branch that is cut at most at a free end, and at a node unless the least length is
        more
    half_widths
        (H, W) float32, distance of each pixel to the edge of the object, in 2-D; (0, 0) if spurs into corners are kept
    origin
        (2,) float64, position of the first pixel of `half_widths`
    corner_widths
        half-widths of the region around a node that a spur must be long to stay
    most_branches
        number of branches that become paths at most, the longest

    Returns
    -------
    points : (P, D) float64, the points of all L paths: first the loops without a junction, whose first point is not repeated
    bounds : (L + 1,) int64, row of the first point of each path; the last entry is P
    closed : (L,) bool, True for a loop
    lengths : (3,) float64, lengths of the spurs and of the small loops removed, and length cut from the ends
    count : number of branches, those too that are beyond `most_branches`
    """

def smooth_depth_beside(
    line: Ints,
    reach: Floats,
    beyond: Floats,
    mask: Bools,
    depth: Floats,
    strength: float,
    mad_to_deviation: float,
    smoothings: int,
) -> NDArray[np.float64]:
    """Return the smooth depth of what is seen on both sides of a strand: the medians across it, then a robust Whittaker smoother.

    Parameters
    ----------
    line
        (S, 2) int64 px (u, v), S >= 2 samples along the strand, a pixel apart
    reach
        (S,) px, radius of the strand at each sample
    beyond
        (A,) px, distances from either side of the strand at which the depth is read
    mask
        (H, W) bool, the pixels that are not beside the strand, since they are of the object
    depth
        (H, W) float32 m, 0 = no reading
    strength
        weight of smoothness, as of `whittaker_smooth`
    mad_to_deviation
        standard deviation per median absolute deviation
    smoothings
        times the depth is smoothed, each time with less weight for what is far from the last result

    Returns
    -------
    (S,) m; (0,) if less than half of the samples have a reading beside them.
    """

def smooth_strand_depth(
    inverse: Floats, measured: Bools, surface: Floats, radius: float, focal: float, numbers: Floats, smoothings: int
) -> tuple[NDArray[np.float64], float, float, float]:
    """Lay a smooth curve through the depth along one strand, by a robust Whittaker smoother.

    It starts from a running median or, where that is behind the strand, from the chain of runs of readings that costs least.

    Parameters
    ----------
    inverse
        (S,) 1/m, inverse depth at each of S >= 4 samples one pixel apart
    measured
        (S,) bool, at least one; elsewhere the inverse depth is interpolated
    surface
        (S,) 1/m, inverse depth of what is seen beside the strand; (0,) if that is not known
    radius
        m, radius of the strand
    focal
        px
    numbers
        (12,): radii on either side of the running median; standard deviations, and radii, by which a reading contradicts the
        curve; radii over which noise of so many radii, the next number, is smoothed; weight of the first curve beside 1 of a
        reading; standard deviation per median absolute deviation; share of samples in front of the curve beyond which the
        strand is looked for among the runs of readings, as it is where its waves are so large that they contradict the curve;
        slope, m per m, from which on a step between two readings is a jump; costs of a reading of what lies behind the chain
        of runs, of another one off the chain, and of a stretch of either
    smoothings
        times the curve is smoothed, each time without what the last curve says are outliers

    Returns
    -------
    depth : (S,) m, of the curve
    waves : m, standard deviation of the readings behind the curve, averaged over a radius on either side
    in_front, torn : shares of the samples in front of the curve by more than an outlier, and of those torn to what lies behind;
        once the strand was looked for among the runs, only its own readings count as in front

    Raises
    ------
    ValueError : lengths differ, nothing is measured, or there are fewer than four samples.
    """

def solve_gap(ends: Floats, radius: float, max_deviation: float, inside: bool) -> tuple[bool, NDArray[np.float64]]:
    """Return the arcs of the path across a gap: an arc, a straight line, an arc, tangent to both ends.

    Parameters
    ----------
    ends
        (4, D) float64, rows: first end, its outward direction, second end, its outward direction
    radius
        radius of the arcs, in the unit of the ends, if the end lines do not meet ahead of both ends; 0 chooses the largest, up
        to half the gap, that keeps `max_deviation`. If the lines meet (skew ones where they are closest), the radius is that of
        the largest circle that touches both ahead of the ends. A radius without a path is made smaller until there is one
    max_deviation
        rad, greatest angle between the straight line and the direct connection of the ends; applies only if the radius is chosen
    inside
        applies if both ends point away from each other: True leads the path through the inside of the gap, False around it

    Returns
    -------
    touch : True if the ends are at the same position
    arcs : (2, 3 D + 2) float64, one arc per row, at the first and at the second end; each starts at its end and runs into the
        gap, and the straight line joins the points where the arcs end. Columns: start (D,), unit direction at the start (D,),
        unit normal from the start towards the center of the circle (D,), angle in radians, radius. (0, 3 D + 2) if the ends
        touch or no path was found
    """

def straight_gap_costs(
    points: Floats,
    first: Ints,
    second: Ints,
    classes: Ints,
    near: float,
    unit_cost: float,
    open_weight: float,
    unknown_weight: float,
) -> NDArray[np.float64]:
    """Return the cost of the straight gap between the ends of each pair: its length times the weighted shares of its samples.

    Parameters
    ----------
    points
        (E, D) float64, positions of the ends
    first, second
        (K,) int64, the ends of each pair
    classes
        (K S,) int64, class of each of S samples along each pair, as of `straight_gaps`; 0 outside the image, 1 unknown, 5 free
        and 6 bare surface count
    near
        distance of two ends below which unknown samples count only if any is open
    unit_cost
        cost per unit of length
    open_weight, unknown_weight
        factors of the share of samples that are outside, free or bare, and of the share that are unknown

    Returns
    -------
    (K,) float64
    """

def straight_gaps(points: Floats, first: Ints, second: Ints, shares: Floats) -> NDArray[np.float64]:
    """Return positions on the straight connections of pairs of ends.

    Parameters
    ----------
    points
        (E, D) float64, positions of the ends
    first, second
        (K,) int64, the ends of each pair
    shares
        (S,) float64, fractions of the connection, from 0 at the first end

    Returns
    -------
    (K S, D) float64, pair by pair
    """

def strand_cuts(
    points: Floats,
    arcs: Floats,
    length: float,
    places: Floats,
    step: float,
    deviation: float,
    outside: float,
    shift: float,
    cut: Floats,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the points before which a strand has to be cut, so that its parts lie along an object.

    Parameters
    ----------
    points
        (N, 3) float64, m, on the strand, in order
    arcs
        (N,) float64, m, arc length of each point from the start of the strand
    length
        arc length of the strand, m
    places
        (P, 3) float64, m, evenly spaced along the object
    step
        arc length of the object between neighboring places, m
    deviation
        standard deviation of a point, m
    outside
        largest cost of a point, in squared standard deviations; one beyond an end of the object is compared with that end
    shift
        how much less a displacement of the whole strand counts than one of a point, as a factor of the standard deviation
    cut
        (N,) float64, cost of a cut before each point, in squared standard deviations

    Returns
    -------
    before : (K,) int64, indices of points, ascending; empty if the strand is best left whole. skipped : (K,) float64 m, how much
    farther along the object, or less far, the next part lies than it would uncut; infinite if it runs in the other direction.
    """

def strand_places(
    points: Floats,
    arcs: Floats,
    sights: Floats,
    bounds: Ints,
    lengths: Floats,
    tips: Floats,
    expected: Floats,
    length: float,
    tolerance: float,
    settings: Floats,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return where the strands of a frame lie along an object whose shape is about known.

    Strands are placed in order of descending length, each where it costs least, in steps and in both directions. The cost is in
    squared standard deviations, which are the error of lengths: the mean square of the offsets of the strand from the samples of
    the object less that of their mean, plus the square of the mean in shares; and the squared distances of tips from the ends of
    the object, in halves of the error.

    Parameters
    ----------
    points, bounds
        (N, 3) float64 m, the points of C strands one after the other, and (C + 1,) int64, the first of each, and N
    arcs, sights
        (N,) float64 m, arc length from the start of its strand, and (N, 3) float64 unit, direction in which the place of the
        point is not known, along which its offset does not count; 0 where it is known
    lengths, tips
        (C,) float64 m, and (C, 2) float64, weights of the ends of a strand as tips of the object
    expected
        (J, 3) float64 m, J >= 2 joints of the object
    length, tolerance
        m, of the object, and largest root mean square of the offsets less their mean
    settings
        (6,) float64: steps per segment; error of lengths, a share of the length; shares of the mean offset, which may be as many
        tolerances; share of a strand that may overlap another one; largest cost of a tip, and of a strand that is placed

    Returns
    -------
    starts : (C,) float64 m, arc length of the object at which the strand begins; NaN if it has no place
    costs : (C,) float64
    backwards : (C,) bool, True for a strand that begins with its last point
    """

def strand_sides(
    view: Floats,
    across: Floats,
    reach: Floats,
    radius: float,
    depth: Floats,
    color: Array,
    mask: Bools,
    core: Floats,
    sides: Floats,
    color_sides: Floats,
    limits: Floats,
) -> tuple[float, float]:
    """Compare a strand with what lies on both of its sides, at S samples along it.

    Parameters
    ----------
    view, across, reach
        (S, 2) px, (S, 2) unit and (S,) px: position of a sample in the view, direction across the strand, and radius there.
    radius
        m, radius of the strand.
    depth
        (H, W) float32 m, 0 = no reading; (0, 0) for none.
    color
        (H, W, 3) uint8 RGB; (0, 0, 3) for none.
    mask
        (H, W) bool; its pixels are no sides.
    core, sides, color_sides
        radii from the axis at which the strand itself is looked at, and the depth and the color of a side.
    limits
        (7,) px by which a side is farther away; px of the median reach below which depth tells nothing; samples of a window;
        radii by which a strand rises at least; standard deviation in radii above which depth tells nothing; standard deviations
        per median absolute deviation; share of the samples whose contrast is lower than the one returned.

    Returns
    -------
    flat : by how much more than half of the windows the strand does not rise from both sides, 0 to 1. The rise is the median in a
        window, the reading of a sample the lower median of its pixels. 0 where depth tells nothing.
    contrast : difference of the strand's color to the more similar side at the sample below which `limits` has the share of
        samples, in 8-bit CIELAB; infinite without color.
    """

def surface_ahead(
    points: Floats, samples: Floats, ends: Ints, tangents: Floats, reach: Floats, max_offset: Floats, max_gap: Floats, window: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Find the surface points ahead of free ends of paths and beside them, up to the first stretch ahead without points.

    A point belongs to an end if it lies in a box around the end and near the tangent line there, and if the sample nearest to it
    is at most `window` samples from the end.

    Parameters
    ----------
    points
        (N, D) float64, N surface points, D = 2 or 3; those that are not finite are left out
    samples
        (S, D) float64, samples along all paths
    ends
        (E,) int64, the sample at each of E free ends
    tangents
        (E, D) float64 unit, tangent at each end, pointing out of its path
    reach
        (E,) float64, half the edge of the box around each end, whose edges are along the axes of the coordinates
    max_offset
        (E,) float64; points at this distance from the tangent line or farther are left out
    max_gap
        (E,) float64; a stretch along the tangent without points that is longer than this ends the points ahead
    window
        number of samples, those of other paths too, by which the index of the nearest sample may differ from that of the end

    Returns
    -------
    axial : (K,) float64, position of each point along the tangent, ascending for each end: 0 at the end, positive outside
    lateral : (K,) float64, distance of each point from the tangent line
    bounds : (E + 1,) int64; the points of end e are [bounds[e]:bounds[e + 1]], the last entry is K

    Notes
    -----
    The points are compared with the ends whose boxes reach into their cell, so that the time grows with the number of points and
    not with that of ends.
    """

def surface_beside(
    joints: Floats, bounds: Ints, camera: Floats, radius: float, lateral: Floats, mask: Bools, depth: Floats, limits: Floats
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Measure the surface beside chains in a depth image.

    The rise at an end is the median distance by which readings beside the joints near the end lie behind the joints.

    Parameters
    ----------
    joints, bounds
        (N, 3) float64 m in the camera's optical frame, the joints of C chains one after the other; (C + 1,) int64, first of each
    camera
        (4,) float64, the intrinsics fx, fy, cx, cy in px
    radius
        m, of the object
    lateral
        (S,) float64 radii, offsets across the chain in the image at which the surface is read
    mask, depth
        (H, W) bool, the object, and (H, W) float32 m, 0 = no reading
    limits
        (5,) float64: m behind a joint up to which a reading counts; m of chain near an end; readings at least; the ratio of the
        rise to its noise that is exceeded; standard deviations per median absolute deviation

    Returns
    -------
    inside : (I,) int64, row-major indices of the pixels of the joints that are in the mask
    around : (A,) int64, of the pixels at the offsets that are outside the mask
    rise : (2 C,) float64 m, at the first and the last joint of each chain; NaN where it is not told from zero
    noise : (2 C,) float64 m, the standard deviation of single readings there; NaN without any
    """

def surface_color(
    color: Array, raised: Bools, window: int, step: int, per_median: float, min_deviation: float, seed: float
) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the color of the surface around strands, its deviation, and the places that differ from it.

    Colors are compared in OpenCV's 8-bit CIELAB, in images scaled down by halves: by 4, and by 8. The surface's color is the
    median in a window of the smaller one. There, pixels mostly within 2 px of raised ones are replaced by the mean of the others
    in the window, so that a coil is none.

    Parameters
    ----------
    color
        (H, W, 3) uint8 RGB, H and W over 4.
    raised
        (H, W) bool.
    window
        px of the smaller image, odd and at most 15.
    step
        px between the samples of the image along a row, and a quarter of that between rows.
    per_median
        standard deviations per median absolute deviation.
    min_deviation
        deviation at least.
    seed
        deviations from which on a pixel of the larger image differs.

    Returns
    -------
    around : (h, w, 3) float32, the surface's color in the smaller image.
    deviation : (3,), robust standard deviation of the image, blurred by a Gaussian of 0.8 px, from the surface's color.
    seeds : (r, c) bool, the pixels of the larger image that differ.
    """

def surface_log_odds(
    points: Floats,
    pixels: Ints,
    readings: Floats,
    noise: float,
    ends: Floats,
    rise: Floats,
    rise_noise: Floats,
    reach: float,
    camera: Floats,
    plane: Floats,
) -> NDArray[np.float64]:
    """Return the log-odds, by depth, that readings are of the surface beside an object, and not of the object at positions.

    They are the distance by which the reading is farther than the position and half the rise at the nearest end, in standard
    deviations of both; where the rise is not known, the distance by which the reading is lower over the plane than half
    the object.

    Parameters
    ----------
    points, pixels, readings
        (N, 3) float64 m in the camera's optical frame; (N, 2) int64, the pixel (u, v) of each; (N,) float64 m, the reading there
    noise
        1/m, standard deviation of readings in inverse depth
    ends, rise, rise_noise
        (E, 3) float64 m, E > 0 ends of chains, and (E,) float64 m, as `surface_beside` measures them there
    reach
        m within which the nearest end is found quickly
    camera, plane
        (4,) float64 intrinsics fx, fy, cx, cy in px, and (5,) float64: normal and height of the plane, and half the height of the
        object over it, m; (0,) each without a plane

    Returns
    -------
    (N,) float64 nat; 0 where it is not known
    """

def thin_pixels(coords: Ints) -> NDArray[np.bool_]:
    """Tell which pixels of a mask belong to its skeleton, lines one pixel wide (Zhang-Suen thinning).

    Pieces of the mask that were connected stay connected, holes stay holes, and an isolated pixel stays.

    coords : (N, 2) int64 >= 1, row and column of each of N pixels, in lexicographic order. Returns (N,) bool, True on the
    skeleton.
    """

def thin_voxels(table: Ints) -> NDArray[np.bool_]:
    """Tell which voxels belong to the curve skeleton, lines one voxel wide (Lee-Kashyap-Chu thinning).

    table : (M, 26) int32 as `neighbor_table` returns it: indices of the neighbors of each of M voxels, -1 for none. Returns (M,)
    bool, True on the skeleton. The numbers of components, loops and cavities stay.

    Each of six directions takes its turn: the voxels exposed in that direction are collected and then deleted in 8 interleaved
    sub-grids, so that no two neighbors are tested one right after the other. Each is tested again just before it is deleted.
    Deleting in index order would erode a strip from one end, since each deletion would expose the next voxel.
    """

def trace_branches(table: Ints) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Trace the branches of a skeleton between its junctions.

    A voxel with more than two neighbors is a junction voxel; junction voxels that touch are one junction. Every other voxel
    belongs to exactly one branch.

    Parameters
    ----------
    table
        (K, 26) int32 as `neighbor_table` returns it: indices of the neighbors of each of K voxels, -1 for none

    Returns
    -------
    junction : (K,) int64, number of the junction that each voxel belongs to, -1 for none
    order : (V,) int64, the V voxels that are not junction voxels, in order along each of B branches, one branch after the other
    bounds : (B + 1,) int64; branch b is order[bounds[b]:bounds[b + 1]], the last entry is V
    nodes : (B, 2) int64, the junctions at the start and at the end of each branch; -1 for a free end, (-2, -2) for a closed loop
    """

def unproject_pinhole(pixels: Floats, depth: Floats, fx: float, fy: float, cx: float, cy: float) -> NDArray[np.float64]:
    """Return the points (N, 3) float64 m at depths along z that are seen at pixels.

    pixels : (N, 2) float64 (u, v), of any layout. depth : (N,) float64 m.
    """

def upper_of_groups(values: Floats, group: Ints, groups: int, share: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the value below the uppermost share of the values of each group.

    Parameters
    ----------
    values
        (N,) float64
    group
        (N,) int64, the group of each value
    groups
        number of groups
    share
        share of the other values of a group that are above the value returned, 0 to 1, rounded down

    Returns
    -------
    value : (groups,) float64, 0 for a group without values
    count : (groups,) int64, number of values in each
    """

def usual_half_width(half_width: Floats, least: float, bin: float, min_share: float) -> float:
    """Return the least half-width that a good part of a medial axis has; 0 if there is none.

    Parameters
    ----------
    half_width
        (K,) float32 px, half-widths at the pixels of the medial axis
    least
        px; thinner parts do not count
    bin
        width of the bins of the logarithm of half-widths; five in a row hold one width
    min_share
        share of the pixels that a half-width needs
    """

def valley_bottoms(depth: Floats, orientation: Array, wanted: Bools, orientations: int) -> NDArray[np.uint8]:
    """Return the pixels that are no less deep than the two beside them across the direction of their valley.

    Parameters
    ----------
    depth, orientation
        (H, W) float32 and (H, W) uint8, as `valley_depth` returns them
    wanted
        (H, W) bool, the pixels that are tested
    orientations
        number of orientations, a multiple of 8

    Returns
    -------
    (H, W) uint8, 1 or 0
    """

def valley_depth(
    image: Floats, wanted: Bools, across: float, along: float, orientations: int
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return the depth of the valleys in an image: the largest response of line detectors, less that to a crest there.

    A detector is the second derivative of a Gaussian across a line, averaged along it by another, in a window of two deviations,
    with mean 0 and absolute sum 2. Border pixels are repeated. Beside OpenCV's filters of the whole image, 6 to 26 times as fast
    on the wide stretches of masks (2.9 ms against 76 ms on 12,800 of 230,000 pixels).

    Parameters
    ----------
    image
        (H, W) float32
    wanted
        (H, W) bool, the pixels that are measured
    across, along
        px, standard deviations across and along a line
    orientations
        even number of orientations, from along the rows on by equal angles over a half turn

    Returns
    -------
    depth : (H, W) float32, in the unit of the image; 0 where it is not wanted
    orientation : (H, W) uint8, number of the orientation that responds most
    """

def values_at_ranks(points: Floats, ranks: Ints) -> NDArray[np.float64]:
    """Return the coordinates that have the given ranks in ascending order, along each axis by itself.

    points : (N, D) float64, finite. ranks : (R,) int64, 0 to N - 1. Returns (R, D) float64.
    """

def view_alignment(
    from_gray: Floats,
    from_inverse: Floats,
    to_gray: Floats,
    to_inverse: Floats,
    intrinsics: Floats,
    pose: Floats,
    light: Floats,
    noise: Floats,
    least_noise: Floats,
    estimator: Floats,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the normal equations of the motion between two views of a scene, by brightness and inverse depth.

    A pixel of the first view with depth is moved by the pose, and compared with the second view there: its brightness, after
    gain and offset, and its inverse depth. Residuals are weighted by Geman and McClure's estimator, in shares of their noise.

    Parameters
    ----------
    from_gray, from_inverse
        (H, W) float32, brightness and inverse depth (1/m) of the first view; NaN where unknown
    to_gray, to_inverse
        (H, W) float32, the same of the second view
    intrinsics
        (4,) float64 px: fx, fy, cx, cy of both views
    pose
        (4, 4) float64 m, p_second = pose @ p_first
    light
        (2,) float64, gain and offset of the brightness from the first view to the second
    noise
        (2,) float64, standard deviations of brightness and of inverse depth (1/m) between the views; 0: from the median residual
    least_noise
        (2,) float64, the least that such a median gives
    estimator
        (2,) float64: standard deviation of residuals by their median size, and the standard deviations at which a residual weighs
        a quarter

    Returns
    -------
    equations : (8, 9) float64, symmetric matrix and right side of the change of (turn about x, y, z, rad; shift along x, y, z, m;
    gain; offset); turn and shift are to be applied to the left of the pose. summary : (7,) float64: noise of the brightness and
    of inverse depth; sums of the losses of either, in squared standard deviations; number of pixels that are known in the first
    view, of those that the second view shows, and of those whose residuals weigh a quarter at least.
    """

def visits() -> int:
    """Return how many elements the kernels looked at in this thread since the last call, and start again at 0.

    Elements are pixels, points, voxels, cells, or pairs of them, with their fixed neighborhoods; bytes that are only cleared or
    searched for the first that is not 0 count eight as one. Equal arguments give equal counts.
    """

def whittaker_smooth(values: Floats, weights: Floats, strength: float, order: int) -> NDArray[np.float64]:
    """Smooth a sequence of points by Whittaker's smoother (Eilers, Analytical Chemistry 75, 2003), in time linear in the points.

    Parameters
    ----------
    values
        (P, D) float64, the P points
    weights
        (P, D, D) float64, weight matrix of each point, symmetric and positive semidefinite
    strength
        weight of smoothness, in the unit of the weights; 0 leaves the points as they are
    order
        order of the differences that are kept small, 1 to 8

    Returns
    -------
    (P, D) float64; the given points if there are no more than `order`. A ValueError says if the weights are too few to determine
    the result, such as all zero.
    """

def wide_readings(depth: Floats, stride: int, scale: float, max_depth: float, half_width: float) -> tuple[int, int]:
    """Count the readings of a depth image that lie deep inside surfaces, and all readings, in every so many rows and columns.

    Gaps of one pixel between readings belong to a surface, and what lies beyond the image to none. The distance to a surface's
    edge is OpenCV's of steps on a 3 x 3 neighborhood.

    Parameters
    ----------
    depth
        (H, W) float32 m, 0 = no reading.
    stride
        px between the rows, and columns, that are looked at.
    scale
        sides of such a pixel per m of depth.
    max_depth
        m; a pixel that is farther away has the size of one there.
    half_width
        m from a surface's edge beyond which a reading lies deep inside.

    Returns
    -------
    wide : number of readings deep inside surfaces.
    readings : number of readings.
    """

def window_sum(values: Floats, path: Ints, half: int) -> NDArray[np.float64]:
    """Return at each sample the sum of the values at the sample and at its neighbors on the same path.

    Parameters
    ----------
    values
        (S,) float64, a value at each of S samples
    path
        (S,) int64, number of the path that each sample lies on; the samples of one path are consecutive
    half
        number of neighbors on either side that are summed; fewer at the first and last samples of a path, also of a ring

    Returns
    -------
    (S,) float64. The sums are differences of one running total, so they carry its rounding.
    """
