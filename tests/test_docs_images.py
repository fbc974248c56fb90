"""The picture of the failures of the paper's rules is the one that its script draws."""

from __future__ import annotations

import subprocess
import sys

import cv2
import numpy as np
import pytest
from builders.paths import ROOT

SCRIPT = ROOT / "docs" / "figures" / "paper_2d.py"
PICTURE = ROOT / "docs" / "pages" / "images" / "paper_2d.png"


def test_the_script_draws_the_picture(tmp_path):
    subprocess.run([sys.executable, str(SCRIPT), str(tmp_path / "new.png")], check=True)
    new, old = (cv2.imread(str(path)).astype(int) for path in (tmp_path / "new.png", PICTURE))
    assert new.shape == old.shape
    assert (np.abs(new - old).max(axis=2) > 40).mean() < 0.02


def test_the_script_draws_the_reliability(tmp_path):
    script, picture = ROOT / "docs" / "figures" / "reliability.py", ROOT / "docs" / "pages" / "images" / "reliability.png"
    subprocess.run([sys.executable, str(script), str(tmp_path / "new.png")], check=True)
    new, old = (cv2.imread(str(path)).astype(int) for path in (tmp_path / "new.png", picture))
    assert new.shape == old.shape
    assert (np.abs(new - old).max(axis=2) > 40).mean() < 0.02


@pytest.mark.parametrize("name", ["choose", "reliability", "simulator", "stages", "troubleshooting"])
def test_scripts_of_pictures_import(name):
    subprocess.run([sys.executable, "-c", f"import {name}"], check=True, cwd=SCRIPT.parent)
