"""The network that comes with doo3d: small, in the wheel, and it finds what it was never trained on."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from builders.paths import ROOT

import doo3d
from doo3d.pipeline import detect_with_stages
from doo3d.segment.methods.network import PACKAGED, object_probability
from doo3d.training.drawing import draw
from doo3d.types import Image


def test_it_is_small():
    assert PACKAGED.stat().st_size < 3_000_000


def test_it_is_in_the_wheel():
    """The wheel holds the package's folder, without what git ignores."""
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'wheel.packages = ["doo3d"]' in project
    assert PACKAGED.is_relative_to(Path(doo3d.__file__).parent)
    assert "onnx" not in (ROOT / ".gitignore").read_text(encoding="utf-8")
    if (ROOT / ".git").exists():
        # the path in the checkout, since the tests may run on a package that is installed elsewhere
        in_checkout = Path("doo3d") / PACKAGED.relative_to(Path(doo3d.__file__).parent)
        assert (ROOT / in_checkout).is_file()
        assert subprocess.run(["git", "check-ignore", "-q", str(in_checkout)], cwd=ROOT, check=False).returncode == 1


def test_it_finds_strands_of_kinds_never_trained_on():
    both = either = 0
    for index in range(12):
        image, truth = draw(77, index, 256, held_out=True)
        found, object_ = object_probability(image) > 0.5, truth[..., 0] > 127
        both += int((found & object_).sum())
        either += int((found | object_).sum())
    assert both > 0.4 * either


@pytest.mark.parametrize("shade", [0, 90, 255])
def test_an_empty_surface_has_no_strand(shade):
    noise = np.random.default_rng(0).normal(shade, 4, (200, 300, 3))
    assert object_probability(np.clip(noise, 0, 255).astype(np.uint8)).max() < 0.5


def test_auto_takes_the_network_and_a_good_frame_has_no_note():
    image = np.full((240, 320, 3), (200, 190, 170), np.uint8)
    rows, columns = np.mgrid[0:240, 0:320]
    image[np.abs(rows - 120 - 50 * np.sin(columns / 60)) < 6] = (30, 60, 200)
    detection, stages = detect_with_stages(Image(image), doo3d.load_config("image"))
    assert (len(detection.chains), stages.observed.segmentation.method, detection.notes) == (1, "network", ())
