"""Open the captures of a rig: a stereo pair, or several depth cameras.

A frame of a stereo pair is triangulated, and frames of depth cameras are fused, when it is loaded.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import inputs
from ..config import Config, ConfigLike, as_config
from ..errors import InputError
from ..guard.guarding import guarded
from ..guard.limits import limited
from ..inputs import Capture, FrameData, FrameRef, ReadOptions
from ..inputs.read_options import DEFAULT, check_used
from ..inputs.rig.pair_images import SIDES, CameraImages, PairImages, find_images, paired, with_masks
from ..inputs.rig.rig_file import RigCamera, RigFile, is_depth_rig, read_rig_file, stereo_pair_of
from ..inputs.rig.stereo_pair import StereoPair
from ..types import Floats
from ..types.arguments import file_path, refused
from .depth_cameras import open_depth_cameras
from .stereo_depth import triangulate

PAIR = "stereo pair"
"""Format of the capture of a stereo pair."""


def open_rig(
    path: str | Path,
    cameras: str | Path,
    config: ConfigLike | None = None,
    masks: str | Path | None = None,
    options: ReadOptions = DEFAULT,
) -> Capture:
    """Open the captures of several calibrated cameras as one capture.

    The capture is accepted by `detect`, `run` and other functions. A frame of a stereo pair without depth is loaded as the
    rectified left image with the triangulated depth of its strands. A frame of several depth cameras is loaded as the cloud of
    the object, fused from all simultaneous views, or as the frame of one camera if the chains found in it alone have a higher
    confidence. Its results are in the rig's coordinates.

    Parameters
    ----------
    path
        the folder with the images or captures of all cameras; for a pair also one image with both views side by side.
    cameras
        the rig file, or the calibration file of a stereo pair (ZED, OpenCV).
    config
        the settings of `detect`; those of the segmentation are used for loading.
    masks
        folder of masks: with a sub-folder for each camera, or with the camera's name in the file names.
    options
        values that the captures lack, for all depth cameras; `pose` is that of the rig in a robot's base frame.

    Returns
    -------
    Capture of the frames that all cameras have.

    Raises
    ------
    InputError : a file cannot be read or used, the cameras' frames are not simultaneous, an option does not
    apply to them, or the
        config is for images.
    """
    path, file, config = file_path(path, "path"), file_path(cameras, "cameras"), as_config(config)
    given = None if masks is None else file_path(masks, "masks")
    if not isinstance(options, ReadOptions):
        raise refused(options, "options", "a ReadOptions")
    options = options.model_copy(update={"cameras": file.absolute()})
    if config.mode == "2d":
        sentence = "--cameras is for results in space, and the config is for images (mode: 2d): use a 3-D one (-c default)"
        raise InputError(sentence, code="config-mode")
    if isinstance(options.pose, str):
        sentence = f"pose={options.pose}: a rig needs the pose itself: give 4x4 or x,y,z,qx,qy,qz,qw"
        raise InputError(sentence, code="pose-invalid")
    limits = config.input.limits()
    with guarded(file), limited(limits):
        for each in (path, file):
            if not each.exists():
                raise InputError(f"{each} does not exist", code="file-missing")
        rig = read_rig_file(file)
        opened = (open_depth_cameras if is_depth_rig(rig) else _open_pair)(path, file, rig, config, given, options)
    base = None if options.pose is None else [list(row) for row in options.pose]
    return replace(opened, options=options, masks=given, base_pose=base, extra_files=[file, *rig.calibration])


def open_frames(path: str | Path, config: Config, masks: str | Path | None, options: ReadOptions) -> Capture:
    """Open a capture for detection, as a rig if the options name its cameras."""
    if options.cameras is not None:
        return open_rig(path, options.cameras, config, masks, options)
    return inputs.open_capture(path, config.mode == "2d", masks, options, limits=config.input.limits())


def _open_pair(path: Path, file: Path, rig: RigFile, config: Config, masks: Path | None, options: ReadOptions) -> Capture:
    """Open the images of a stereo pair.

    The images are those of the cameras in the rig file, or of the folders left/ and right/, or both halves of one image.
    """
    check_used(options, {"cameras", "pose"}, f"{path}, the images of a stereo pair")
    halves = path.is_file() or not all((path / side).is_dir() for side in SIDES)
    cameras = rig.cameras or tuple(
        RigCamera(name=side, **({"side_by_side": side} if halves else {"images": side})) for side in SIDES
    )
    found = [find_images(path, each.images, each.name, each.side_by_side) for each in cameras]
    left, right = with_masks(paired(*found), path, (cameras[0].masks, cameras[1].masks), masks)
    sizes = left.size(), right.size()
    if None not in sizes and sizes[0] != sizes[1]:
        shown = " and ".join(f"{size[0]}x{size[1]}" for size in sizes if size is not None)
        raise InputError(f"{path}: the images of both cameras are {shown}: expected the same size", code="image-shape")
    pair = stereo_pair_of(rig, sizes[0], file)
    rectified = pair.rectified()
    base = _pair_pose(cameras[0], options, rectified.turns[0])
    frames = [
        FrameRef(name, left.files[name], PairLoader(left.of_frame(name), right.of_frame(name), name, pair, config, base))
        for name in left.files
    ]
    notes = [
        f"the cameras of the pair are {1000 * pair.baseline:.4g} mm apart ({pair.source})",
        f"masks: {len(left.masks)} of the camera {left.name}, {len(right.masks)} of the camera {right.name}",
    ]
    return Capture(path, PAIR, frames, notes)


def _pair_pose(camera: RigCamera, options: ReadOptions, turn: Floats) -> Floats | None:
    """Return the pose (4, 4) m of the rectified left camera; None if it is unknown.

    It is in the robot's base frame if the options give the pose of the rig, else in the rig's frame. turn : (3, 3) rotation of
    the rectification.
    """
    if camera.pose is None and options.pose is None:
        return None
    own, base = (np.eye(4) if pose is None else np.array(pose) for pose in (camera.pose, options.pose))
    rectified = np.eye(4)
    rectified[:3, :3] = turn.T
    return np.asarray(base @ own @ rectified)


@dataclass(frozen=True)
class PairLoader:
    """The loader of one frame of a stereo pair.

    Attributes
    ----------
    left, right
        the images of each camera, with their masks.
    name
        name of the frame.
    pair
        the calibration.
    config
        the settings of `detect`.
    base_pose
        (4, 4) m, pose of the rectified left camera in the rig's or the robot's base frame; None if unknown.
    """

    left: CameraImages
    right: CameraImages
    name: str
    pair: StereoPair
    config: Config
    base_pose: Floats | None

    def images(self) -> PairImages:
        """Read both images and their masks, as the cameras recorded them."""
        (left, left_mask), (right, right_mask) = self.left.load(self.name), self.right.load(self.name)
        return PairImages(left, right, left_mask, right_mask, self.name)

    def __call__(self) -> FrameData:
        """Return the rectified left image with the depth of its strands."""
        return replace(triangulate(self.images(), self.pair.rectified(), self.config), base_pose=self.base_pose)
