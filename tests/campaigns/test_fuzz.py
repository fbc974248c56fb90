"""The fuzzer in short: some hundred inputs, the same ones each time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="forks, and reads memory and time from /proc")
@pytest.mark.parametrize("options", ["--count 250 --seed 1", "--settings --step 4"])
def test_each_changed_input_or_setting_is_a_result_or_a_sentence(options):
    pytest.importorskip("rosbags")
    done = subprocess.run([sys.executable, Path(__file__).with_name("fuzz.py"), *options.split()], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "the slowest" in done.stdout
