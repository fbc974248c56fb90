"""Define documented cameras of devices and data sets, for folders without a camera file."""

from typing import NamedTuple

from .calibration import Pinhole
from .images import Size


class KnownCamera(NamedTuple):
    """A documented camera of depth images.

    Attributes
    ----------
    pinhole
        the tuple (fx, fy, cx, cy) in px.
    size
        required (width, height) of the images in px; None for any size.
    note
        sentence for the user; `{unit}` in it is replaced by the unit of depth.
    """

    pinhole: Pinhole
    size: Size | None = None
    note: str = ""


VGA = (640, 480)
_REMEDY = "give --camera FILE if the recording is of your own"
_CALIBRATED = "the camera is the benchmark's calibration of"

FREIBURG = {  # TUM RGB-D, file_formats, "Calibration of the color camera", whose pixels the depth images have
    "freiburg1": KnownCamera((517.3, 516.5, 318.6, 255.3), VGA, f"{_CALIBRATED} freiburg1"),
    "freiburg2": KnownCamera((520.9, 521.0, 325.1, 249.7), VGA, f"{_CALIBRATED} freiburg2"),
    "freiburg3": KnownCamera((535.4, 539.2, 320.1, 247.6), VGA, f"{_CALIBRATED} freiburg3"),
}
PRIMESENSE = (525.0, 525.0, 319.5, 239.5)
TUM = KnownCamera(PRIMESENSE, VGA, f"the camera is the benchmark's default, fx = fy = 525 px{{unit}}: {_REMEDY}")
REDWOOD = KnownCamera(PRIMESENSE, VGA, f"the camera is the data set's default, fx = fy = 525 px: {_REMEDY}")
ICL_NUIM = KnownCamera((481.2, 480.0, 319.5, 239.5), VGA)  # the data set's fy is -480, for its y points up
SEVEN_SCENES = KnownCamera(  # Shotton et al., Scene Coordinate Regression Forests (CVPR 2013): the data set's page
    (585.0, 585.0, 320.0, 240.0), VGA, f"the camera is the default of the data set 7-Scenes, fx = fy = 585 px: {_REMEDY}"
)
STRAY_VIDEO_SIZE = (1920, 1440)  # px, of Stray Scanner, whose intrinsics are those of its video
