"""Pictures of the documentation are those that their scripts draw."""

from __future__ import annotations

import subprocess
import sys

import cv2
import numpy as np
import pytest
from builders.paths import ROOT

from doo3d import Image, detect, load_config

FIGURES, PICTURES = ROOT / "docs" / "figures", ROOT / "docs" / "pages" / "images"


@pytest.mark.parametrize("name", ["paper_2d", "reliability"])
def test_the_script_draws_the_picture(tmp_path, name):
    subprocess.run([sys.executable, FIGURES / f"{name}.py", tmp_path / "new.png"], check=True)
    new, old = (cv2.imread(str(path)).astype(int) for path in (tmp_path / "new.png", PICTURES / f"{name}.png"))
    assert new.shape == old.shape
    assert (np.abs(new - old).max(axis=2) > 40).mean() < 0.02


@pytest.mark.parametrize("name", ["choose", "simulator", "stages", "troubleshooting"])
def test_scripts_of_pictures_import(name):
    subprocess.run([sys.executable, "-c", f"import {name}"], check=True, cwd=FIGURES)


@pytest.mark.parametrize(
    "radius", [55, pytest.param(45, marks=pytest.mark.xfail(strict=True, reason="only ends that keep their bend went round it"))]
)
def test_a_cable_25_px_wide_is_followed_round_a_loop(radius, monkeypatch):
    monkeypatch.syspath_prepend(FIGURES)
    cable = __import__("paper_2d").mask(radius, 140)
    image = Image(np.where(cable[:, :, None], (150, 150, 150), (40, 40, 40)).astype(np.uint8))
    (chain,) = detect(image, load_config("image", {"merge.chains": 1}), cable).chains
    assert np.linalg.norm(np.diff(chain.joints, axis=0), axis=1).sum() > 500 + 4 * radius
