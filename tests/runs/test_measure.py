"""The scripts that measure runs and reports still run; the pages show what they print."""

import subprocess
import sys
from pathlib import Path

import pytest
from builders import browser

ROOT = Path(__file__).resolve().parents[2]
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc")]


def printed(script: str, *options: str) -> str:
    done = subprocess.run([sys.executable, f"docs/{script}", *options], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_speed_and_kills():
    text = printed("measure_runs.py", "--frames", "3", "--kills", "2")
    assert "byte-equal: 2 of 2" in text
    assert "resumed: byte-equal 2 of 2" in text


def test_memory():
    text = printed("measure_runs.py", "--flat", "60")
    assert text.count("'frames': 80, 'ok': 80, 'failed': 0, 'chains': 160") == 2


@pytest.mark.browser
@pytest.mark.skipif(browser.chromium() is None, reason="no Chromium on this machine")
def test_the_report():
    text = printed("measure_report.py", "--frames", "25", "--opened", "1")
    assert text.startswith("25 frames, report of ")
    assert text.count("opened: first paint") == 1
