"""The snippets for drivers run against stand-ins of the same interface, and find what is in the frames."""

from __future__ import annotations

import re

import pytest
from builders.paths import ROOT
from test_readme import blocks, run_python

PAGE = ROOT / "docs" / "pages" / "streaming.md"
LINES = {
    "pyrealsense2": r"RealSense: Detection\('frame', 1 chain, 1\.0[78]\d m, 1 crossing, .*",
    "rclpy": r"ROS: 10[789] joints, 1\.0[78]0 m in camera_color_optical_frame on cable",
    "lerobot": r"LeRobot: Detection\('frame', 1 chain, 1\.(?:09|10)\d m, 1 crossing, .*",
}


@pytest.mark.slow
@pytest.mark.parametrize("module", LINES)
def test_the_snippet_of_a_driver_finds_the_cable_in_every_frame(module, tmp_path):
    (snippet,) = [
        text for language, text in blocks(PAGE) if language == "python" and re.search(rf"^(from|import) {module}\b", text, re.M)
    ]
    printed = run_python(f"import doo3d\n{snippet}", tmp_path).splitlines()
    assert len(printed) == 3
    assert all(re.fullmatch(LINES[module], line) for line in printed), printed
