"""The campaigns in short: some kills, some errors of the disk, some surroundings."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals and forks")]

HERE = Path(__file__).parent


def campaign(script: str, *arguments: object) -> str:
    """Run a campaign in a process of its own, since it forks; what it prints."""
    command = [sys.executable, HERE / script, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize(("workers", "options"), [(0, ()), (2, ()), (0, ("--sequence",))])
def test_kills_and_errors(workers, options):
    cases = ("--random", 1, "--operations", "--errors", "--most", 2)
    text = campaign("kills.py", *cases, "--workers", workers, "--seed", workers, *options)
    assert "random moments: 1 of 1" in text
    assert text.count("2 of 2") == 2


def test_errors_do_not_concern_pipes(tmp_path):
    code = """
import os, sys
from pathlib import Path
from faults import Fault, inject
folder = Path(sys.argv[1])
fault = Fault("EIO", 2)
inject(fault, folder)
reads, writes = os.pipe()
file = os.open(folder / "file", os.O_WRONLY | os.O_CREAT)
os.write(writes, b"noop")
try:
    os.write(file, b"result")
except OSError:
    print(fault.count)
"""
    done = subprocess.run([sys.executable, "-c", code, tmp_path], cwd=HERE, capture_output=True, text=True, check=True)
    assert done.stdout == "2\n"


def test_surroundings(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    from same_bytes import CHOICES, compare

    usual = {key: values[0] for key, values in CHOICES.items()}
    other = {"hash seed": "1", "threads": "8", "workers": "1", "language": "C", "zone": "Asia/Kathmandu"}
    assert compare(tmp_path, [usual | other]) == []


def test_instructions_without_valgrind_are_not_counted(monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert "valgrind is not installed" in campaign("instructions.py")


def test_frames_with_over_2_percent_more_instructions_are_named(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    from instructions import above

    assert above({"a": 102.1, "b": 101.9, "new": 7.0}, {"a": 100.0, "b": 100.0}) == ["a: 2.1 % more than the recorded 100.0"]
