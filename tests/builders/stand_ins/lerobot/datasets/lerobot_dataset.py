"""Stand-in for LeRobot's data set: items with a depth image as a tensor (1, H, W), no reading as the least depth."""

from __future__ import annotations

import doo3d_sample as sample
import numpy as np

LEAST_DEPTH = 0.01  # m


class Tensor:
    """What is used of a tensor of torch: NumPy reads it."""

    def __init__(self, array):
        self._array = np.asarray(array)

    def __array__(self, dtype=None, copy=None):
        return np.array(self._array, dtype=dtype)

    def __float__(self):
        return float(self._array)


class LeRobotDataset:
    def __init__(self, repo_id, root=None, episodes=None, *, depth_output_unit="mm"):
        assert "/" in repo_id
        self.depth_output_unit = depth_output_unit

    def __len__(self):
        return sample.COUNT

    def __getitem__(self, idx):
        if not 0 <= idx < len(self):
            raise IndexError(idx)
        millimetres = np.maximum(sample.depth(idx), 1000 * LEAST_DEPTH)[None]
        depth = millimetres if self.depth_output_unit == "mm" else millimetres.astype(np.float32) / 1000
        return {"observation.images.front_depth": Tensor(depth), "timestamp": Tensor(np.float32(idx / 30)), "task": "route"}
