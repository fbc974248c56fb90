"""The picture of where the paper's rules go wrong is what its script draws, and goes wrong there."""

from __future__ import annotations

import subprocess
import sys

import cv2
import numpy as np
from builders.paths import ROOT

IMAGES = ROOT / "docs" / "images"


def test_the_picture_is_what_the_script_draws(tmp_path):
    subprocess.run([sys.executable, str(IMAGES / "paper_2d.py"), str(tmp_path / "new.png")], check=True)
    new, old = (cv2.imread(str(path)).astype(int) for path in (tmp_path / "new.png", IMAGES / "paper_2d.png"))
    assert new.shape == old.shape
    assert (np.abs(new - old).max(axis=2) > 40).mean() < 0.02
