"""Detect in a stream of frames, one after another, with ids that persist."""

from numpy.typing import ArrayLike

from ..config import Config, ConfigLike, as_config
from ..pipeline import detect
from ..types import Array, Cloud, Detection, Frame, Image
from .tracking import Tracker


class Detector:
    """Detector for a stream of frames: chains keep their id and direction.

    The settings are checked once, on construction. Nothing runs in the background: `update` takes as long as `doo3d.detect`,
    so skip frames that arrive in the meantime and pass the latest one.

    Parameters
    ----------
    config
        the settings, as `doo3d.detect` takes them; None for the preset "default".
    pose
        pose in the robot's base frame of a camera that does not move, m: 4x4 with p_base = pose @ p_camera, or seven numbers
        x y z qx qy qz qw. None leaves the chains in the camera frame.

    Raises
    ------
    ArgumentError, ConfigError : the settings cannot be used.

    Examples
    --------
    >>> detector = Detector({"merge.chains": 1})
    >>> while camera.is_open():  # doctest: +SKIP
    ...     detection = detector.update(doo3d.Frame(*camera.latest()))
    """

    def __init__(self, config: ConfigLike | None = None, pose: ArrayLike | None = None) -> None:
        self._config = as_config(config)
        self._pose = pose
        self._tracker = Tracker(self._config.tracking)

    @property
    def config(self) -> Config:
        """The settings of all frames."""
        return self._config

    def update(self, data: Frame | Cloud | Image | Array, mask: Array | None = None, pose: ArrayLike | None = None) -> Detection:
        """Return the chains of the next frame with their earlier ids and directions.

        An error leaves the ids unchanged: continue with the next frame.

        Parameters
        ----------
        data
            the frame after the one given last.
        mask
            the caller's segmentation, True on the object: (H, W) bool for a Frame or an image, (N,) bool for a Cloud. None
            segments according to the settings.
        pose
            pose of a moving camera in the robot's base frame at the time of the frame; None uses the pose given on
            construction. Pass one for every frame or for none, since ids are assigned by position.

        Raises
        ------
        InputError : the data cannot be used; the message names the fault, the place and the remedy.
        """
        return self._tracker.update(detect(data, self._config, mask, self._pose if pose is None else pose))

    def reset(self) -> None:
        """Remove all remembered chains, so that ids restart at 0.

        Call it after a cut or a change of the scene.
        """
        self._tracker = Tracker(self._config.tracking)

    def __repr__(self) -> str:
        return f"Detector({self._config!r}, {len(self._tracker.state.tracked)} chains remembered)"
