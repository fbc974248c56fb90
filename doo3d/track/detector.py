"""Detection in a stream: one frame after the other, with ids that stay."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ..config import Config, ConfigLike, as_config
from ..pipeline import detect
from ..types import Array, Cloud, Detection, Frame, Image
from .tracking import Tracker


class Detector:
    """Detector for a stream of frames, such as of a camera in a loop: chains keep their id and direction from frame to frame.

    The settings are checked once, on construction. Nothing runs in the background: `update` takes as long as `doo3d.detect`, so
    leave out frames that arrive meanwhile, and give the latest.

    Parameters
    ----------
    config
        the settings, as `doo3d.detect` takes them; None for the preset "default".
    pose
        pose of a camera that does not move in the robot's base frame, m: 4x4, p_base = pose @ p_camera, or the seven numbers
        x y z qx qy qz qw. None leaves chains in the camera's frame.

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
        """Return the chains of the next frame, with the ids and directions that they had in the frames before.

        An error leaves the ids as they are: go on with the next frame.

        Parameters
        ----------
        data
            the frame after the one given last.
        mask
            the caller's own segmentation, True on the object: (H, W) bool for a Frame or an image, (N,) bool for a Cloud. None
            segments as the settings say.
        pose
            pose of the camera in the robot's base frame at the time of the frame, for a camera that moves; None: that given on
            construction. Give one for every frame or for none: ids are found by position.

        Raises
        ------
        InputError : the data cannot be used; the message says what is wrong, where, and what to do.
        """
        return self._tracker.update(detect(data, self._config, mask, self._pose if pose is None else pose))

    def reset(self) -> None:
        """Forget all chains, such as after a cut or a change of the scene: the next frame's ids begin at 0."""
        self._tracker = Tracker(self._config.tracking)

    def __repr__(self) -> str:
        return f"Detector({self._config!r}, {len(self._tracker.state.tracked)} chains remembered)"
