"""Simulate a stereo depth camera: render an infrared pair, match it, and align the depth to the color camera."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.random import Generator

from ...types import Array, Bools, Camera, Floats
from .infrared import InfraredLight, expose, infrared_view
from .rays import RayCaster

DISPARITY_UNIT = 1 / 16
"""Step in px of the sub-pixel disparities of cv2.StereoSGBM."""

REFERENCE_DEPTH = 0.6
"""Depth in m at which the projected pattern has its full brightness, for scenes without a table."""

REFINEMENTS, MAX_REFINEMENT, MIN_SLOPE = 3, 1.0, 1.0
"""Sub-pixel refinement: number of steps; greatest change in px; term in (gray levels / px)² that is added to the mean squared
slope, so that noise does not move flat surfaces."""

TEXTURE_SIGMA_PX = 4.0
"""Sigma in px of the window in which texture is measured."""

MIN_FATTENED_STEP = 2.0
"""Step of disparity in px between background and foreground above which the foreground is widened."""

FAR = 1e6
"""Depth in m of pixels without a reading, during alignment."""


@dataclass(frozen=True)
class StereoSensor:
    """A stereo depth camera with a color camera beside it, like a RealSense D435.

    The axes of all cameras are parallel; the cameras lie on a line along x.

    Attributes
    ----------
    baseline
        distance in m from the left to the right infrared camera.
    color_offset
        distance in m from the left infrared camera to the color camera.
    focal_ratio
        focal length of the infrared cameras, in focal lengths of the color camera at the same width of the image.
    nearest
        least depth in m that the search for matches covers.
    blur
        sigma in px of the blur of the infrared images.
    noise
        (least, greatest) standard deviation of the infrared images' noise, gray levels; each frame has a random value.
    block
        edge of the compared blocks, px; odd.
    window
        sigma in px of the window of the sub-pixel refinement.
    min_texture
        RMS slope in gray levels per px below which nothing is measured.
    fattening
        width in px that is added to the foreground at large steps, both sides together, besides the widening by the blocks.
    uniqueness
        margin in % by which the best match must be better than the second best.
    speckle_size, speckle_range
        greatest number of pixels of a region that is removed as a speckle, for an image 1280 px wide, and difference of disparity
        in px within a region.
    left_right
        greatest difference in px between the disparities found from the left and from the right image.
    calibration_error
        (least, greatest) displacement of the aligned depth in a miscalibrated frame, px of the color image.
    calibrated
        fraction, 0 to 1, of the frames without a calibration error.
    depth_step
        step in m to whose multiples the depth is rounded.
    """

    baseline: float = 0.050
    color_offset: float = 0.015
    focal_ratio: float = 640 / 920
    nearest: float = 0.25
    blur: float = 0.8
    noise: tuple[float, float] = (1.0, 2.5)
    block: int = 5
    window: float = 5.5
    min_texture: float = 1.3
    fattening: int = 2
    uniqueness: int = 10
    speckle_size: int = 100
    speckle_range: int = 1
    left_right: int = 1
    calibration_error: tuple[float, float] = (0.5, 1.5)
    calibrated: float = 0.5
    depth_step: float = 0.001


STEREO_SENSORS = {"stereo": StereoSensor(), "coarse": StereoSensor(block=17, window=8.0, uniqueness=0)}
"""Name -> stereo camera. "coarse" compares blocks three times as wide, so that thin cables get the depth of their background."""


@dataclass(frozen=True)
class StereoPair:
    """The images of the two infrared cameras, with their intrinsics and the disparity range for matching.

    Attributes
    ----------
    left, right
        (H, W) uint8.
    shiny
        (H, W) bool, pixels of the left image on surfaces that the sensor cannot measure.
    camera
        the intrinsics of both cameras.
    disparities
        number of searched disparities, from 0 on.
    """

    left: Array
    right: Array
    shiny: Bools
    camera: Camera
    disparities: int


def measure_stereo(caster: RayCaster, sensor: StereoSensor, rng: Generator) -> Array:
    """Return the depth image of a scene, aligned to its color camera: (H, W) float32 m, 0 where nothing is measured.

    Parameters
    ----------
    caster
        the scene, in the optical frame of its color camera.
    sensor
        the stereo camera.
    rng
        the random number generator of texture, noise and calibration; the same state gives the same image.
    """
    pair = render_pair(caster, sensor, rng)
    depth = match(pair, sensor)
    shift = np.zeros(2)
    size, direction, drawn = rng.uniform(*sensor.calibration_error), rng.uniform(0, 2 * np.pi), rng.random()
    if drawn >= sensor.calibrated:
        shift = size * np.array([np.cos(direction), np.sin(direction)])
    aligned = align(depth, pair.camera, caster.scene.camera, sensor.color_offset, shift)
    return np.asarray(np.round(aligned / sensor.depth_step) * sensor.depth_step, dtype=np.float32)


def infrared_camera(color: Camera, sensor: StereoSensor) -> tuple[Camera, int]:
    """Return the intrinsics of the infrared images, cropped to the color camera's view, and the number of disparities.

    The left margin holds the pixels that have no counterpart in the right image at the greatest disparity.
    """
    fx, fy = color.fx * sensor.focal_ratio, color.fy * sensor.focal_ratio
    disparities = 16 * int(np.ceil(fx * sensor.baseline / sensor.nearest / 16))
    margin = sensor.block + 4
    left = disparities + margin
    right = int(np.ceil(fx * sensor.color_offset / sensor.nearest)) + margin
    cx, cy = left + color.cx * sensor.focal_ratio, margin + color.cy * sensor.focal_ratio
    width = left + right + int(np.ceil(color.width * sensor.focal_ratio))
    height = 2 * margin + int(np.ceil(color.height * sensor.focal_ratio))
    return Camera(fx, fy, cx, cy, width, height), disparities


def render_pair(caster: RayCaster, sensor: StereoSensor, rng: Generator) -> StereoPair:
    """Render the images of both infrared cameras, with the projector between them.

    Parameters
    ----------
    caster
        the scene, in the optical frame of its color camera.
    sensor
        the stereo camera.
    rng
        the random number generator of texture, pattern and noise.
    """
    scene = caster.scene
    camera, disparities = infrared_camera(scene.camera, sensor)
    left = np.array([-sensor.color_offset, 0.0, 0.0])
    right = left + np.array([sensor.baseline, 0.0, 0.0])
    light = InfraredLight.draw(rng, camera, (left + right) / 2)
    noise = rng.uniform(*sensor.noise)
    table = scene.table
    reference = REFERENCE_DEPTH if table is None else float(table.point @ table.normal / table.normal[2])
    views = [infrared_view(caster, camera, origin, light, reference) for origin in (left, right)]
    images = [expose(image, sensor.blur, noise, rng) for image, _ in views]
    return StereoPair(images[0], images[1], views[0][1], camera, disparities)


def match(pair: StereoPair, sensor: StereoSensor) -> Floats:
    """Return the depth (H, W) m of the left infrared image, 0 where no match is found.

    The matcher is `cv2.StereoSGBM` (Hirschmueller, "Stereo Processing by Semiglobal Matching and Mutual Information", PAMI 2008)
    with sub-pixel interpolation, left-right check and speckle filter.

    pair : the two images. sensor : the stereo camera.
    """
    matcher = cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=pair.disparities,
        blockSize=sensor.block,
        P1=8 * sensor.block**2,
        P2=32 * sensor.block**2,
        disp12MaxDiff=sensor.left_right,
        preFilterCap=31,
        uniquenessRatio=sensor.uniqueness,
        speckleWindowSize=max(4, round(sensor.speckle_size * (pair.camera.fx / 640) ** 2)),
        speckleRange=sensor.speckle_range,
        mode=cv2.STEREO_SGBM_MODE_SGBM_3WAY,
    )
    disparity = matcher.compute(pair.left, pair.right).astype(np.float32) * DISPARITY_UNIT
    valid = (disparity > 0) & ~pair.shiny
    refined, texture = refine(pair, np.where(valid, disparity, 0.0), sensor)
    disparity = fatten(refined, sensor.fattening)
    valid = (disparity > 0) & (texture >= sensor.min_texture) & ~pair.shiny
    return np.where(valid, pair.camera.fx * sensor.baseline / np.where(valid, disparity, 1.0), 0.0)


def refine(pair: StereoPair, disparity: Array, sensor: StereoSensor) -> tuple[Floats, Floats]:
    """Refine disparities to sub-pixel precision, since those of cv2.StereoSGBM are biased towards whole pixels.

    Around each pixel, the right image is shifted so that its difference from the left one is least, by Gauss-Newton steps (Lucas
    and Kanade, 1981, in one dimension).

    Parameters
    ----------
    pair
        the two images.
    disparity
        (H, W) px, correct within about a pixel; 0 where there is none.
    sensor
        the stereo camera.

    Returns
    -------
    disparity : (H, W) px, 0 where there is none.
    texture : (H, W), root mean square of the slope of the right image around the matched pixel, gray levels per px.
    """
    left, right = pair.left.astype(np.float32), pair.right.astype(np.float32)
    gradient = cv2.Scharr(right, cv2.CV_32F, 1, 0, scale=1 / 32)
    row, column = np.mgrid[0 : left.shape[0], 0 : left.shape[1]].astype(np.float32)
    start, refined = disparity.astype(np.float32), disparity.astype(np.float32)
    valid = disparity > 0
    for _ in range(REFINEMENTS):
        there = column - refined
        slope = cv2.remap(gradient, there, row, cv2.INTER_LINEAR)
        error = cv2.remap(right, there, row, cv2.INTER_CUBIC) - left
        slope[~valid], error[~valid] = 0, 0
        top, bottom = (cv2.GaussianBlur(image, (0, 0), sensor.window) for image in (slope * error, slope * slope))
        refined = np.clip(refined + top / (bottom + MIN_SLOPE), start - MAX_REFINEMENT, start + MAX_REFINEMENT)
    slope = cv2.GaussianBlur(gradient * gradient, (0, 0), TEXTURE_SIGMA_PX)
    texture = np.sqrt(cv2.remap(slope, column - refined, row, cv2.INTER_LINEAR))
    return np.where(valid, refined, 0.0), texture


def fatten(disparity: Floats, size: int) -> Floats:
    """Widen the foreground of disparities at large steps, as the block matcher of a real sensor does.

    disparity : (H, W) px, 0 where there is none. size : growth of the foreground in width and in height, px.
    """
    grown = cv2.dilate(disparity.astype(np.float32), np.ones((size + 1, size + 1), np.uint8))
    return np.where(grown - disparity > MIN_FATTENED_STEP, grown, disparity)


def align(depth: Floats, infrared: Camera, color: Camera, offset: float, shift: Floats) -> Floats:
    """Transform a depth image to the color camera: (H, W) m, 0 at pixels without a reading.

    Each reading fills the rectangle of color pixels that its pixel covers, and the nearest reading wins, as librealsense aligns
    depth to color.

    Parameters
    ----------
    depth
        (H, W) m, the depth image of the left infrared camera; 0 for no reading.
    infrared, color
        the intrinsics of the left infrared and of the color camera, whose axes are parallel.
    offset
        distance along x from the infrared to the color camera, m.
    shift
        (2,) displacement of the readings in the color image, (x, y) px.
    """
    v, u = np.nonzero(depth > 0)
    z = depth[v, u]
    far_first = np.argsort(-z, kind="stable")
    v, u, z = v[far_first], u[far_first], z[far_first]
    low, high = (
        np.column_stack(
            (
                ((u + side - infrared.cx) / infrared.fx - offset / z) * color.fx + color.cx + shift[0],
                (v + side - infrared.cy) / infrared.fy * color.fy + color.cy + shift[1],
            )
        )
        for side in (-0.5, 0.5)
    )
    first, last = (np.floor(corner + 0.5).astype(int) for corner in (low, high))
    result = np.full(color.height * color.width, FAR)
    for dv in range(int((last - first)[:, 1].max(initial=-1)) + 1):
        for du in range(int((last - first)[:, 0].max(initial=-1)) + 1):
            x, y = first[:, 0] + du, first[:, 1] + dv
            inside = (x <= last[:, 0]) & (y <= last[:, 1]) & (x >= 0) & (y >= 0) & (x < color.width) & (y < color.height)
            np.minimum.at(result, (y * color.width + x)[inside], z[inside])
    return np.where(result < FAR, result, 0.0).reshape(color.height, color.width)
