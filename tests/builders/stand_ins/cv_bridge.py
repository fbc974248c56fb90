"""Stand-in for cv_bridge: images of the encodings that the sample is sent in."""

from __future__ import annotations

import numpy as np

TYPES = {"16UC1": np.uint16, "32FC1": np.float32, "bgr8": np.uint8}


class CvBridge:
    def imgmsg_to_cv2(self, img_msg, desired_encoding="passthrough"):
        pixels = np.frombuffer(img_msg.data, TYPES[img_msg.encoding]).reshape(img_msg.height, img_msg.width, -1)
        if desired_encoding == "rgb8":
            assert img_msg.encoding == "bgr8"
            return np.ascontiguousarray(pixels[..., ::-1])
        assert desired_encoding == "passthrough"
        return pixels[..., 0] if pixels.shape[2] == 1 else pixels
