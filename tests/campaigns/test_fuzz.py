"""The fuzzer in short: some hundred inputs, the same ones each time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="forks, and reads memory and time from /proc")
def test_each_changed_input_is_a_result_or_a_sentence():
    pytest.importorskip("rosbags")
    done = subprocess.run([sys.executable, HERE / "fuzz.py", "--count", "250", "--seed", "1"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "250 inputs of seed 1" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="forks, and reads memory and time from /proc")
def test_each_setting_at_its_bounds_is_a_result_or_a_sentence():
    done = subprocess.run([sys.executable, HERE / "fuzz.py", "--settings"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " settings: " in done.stdout
