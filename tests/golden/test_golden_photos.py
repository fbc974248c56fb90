"""The 2-D mode finds in the sample photographs what it found before, and what is there."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from golden.renew import AXES, CASES, HERE, difference, found, gap, golden, text

from doo3d.tools.compare.line_alignment import align_line, resample_line

MOVED = 0.5  # px


@pytest.mark.parametrize(("photo", "preset"), CASES)
def test_the_same_chains_as_before(photo, preset):
    """Where this is wanted: `python tests/golden/renew.py`, and look at the diff."""
    old, new = json.loads(golden(photo, preset).read_text()), json.loads(text(found(photo, preset)))
    assert [len(chain["joints"]) for chain in new] == [len(chain["joints"]) for chain in old], difference(old, new)
    for was, now in zip(old, new, strict=True):
        assert gap(was["joints"], now["joints"]) <= MOVED
        assert (now["segment_length"], now["closed"]) == (was["segment_length"], was["closed"])
        assert now["radius"] == pytest.approx(was["radius"], abs=MOVED)
        flags = [np.array(chain["joints"])[:, 2] for chain in (was, now)]
        assert np.abs(np.cumsum(flags[0]) - np.cumsum(flags[1])).max() <= 1


@pytest.mark.parametrize("photo", AXES)
def test_what_is_kept_is_true(photo):
    """One chain per cable, from end to end, within its width, in one go."""
    cables = [(np.array(cable["axis"]), cable["radius"]) for cable in AXES[photo]]
    chains = json.loads(golden(photo, "image").read_text())
    assert len(chains) == len(cables)
    truths = [resample_line(axis, np.full(len(axis), radius)) for axis, radius in cables]
    followed = []
    for chain in chains:
        joints = np.array(chain["joints"])[:, :2]
        alignment = align_line(resample_line(joints, np.zeros(len(joints))), truths, chain["segment_length"], 2.0)
        assert (alignment.distance <= alignment.tolerance).all()
        assert alignment.jumps == ()
        cable = alignment.line[0]
        followed.append(int(cable))
        assert chain["radius"] == pytest.approx(cables[cable][1], abs=0.8)
        assert np.ptp(alignment.arc) == pytest.approx(truths[cable].arcs[-1], abs=1.2 * chain["segment_length"])
    assert sorted(followed) == list(range(len(cables)))


def test_every_file_is_of_a_photograph():
    assert {path.name for path in HERE.glob("*.*.json")} == {golden(*case).name for case in CASES}


def test_differences_in_words():
    old = [{"joints": [[0, 0, 0], [10, 0, 0]], "radius": 3.0}]
    assert difference(old, old) == ""
    assert difference(old, [{"joints": [[0, 0, 0], [10, 3, 0]], "radius": 3.0}]) == "joints moved by up to 3.00 px"
    assert difference(old, [{"joints": [[0, 0, 0], [10, 0, 0]], "radius": 4.0}]) == "radius or flags changed"
    assert difference([], old) == "2 joints, were no"


@pytest.mark.slow
def test_the_command_that_renews(tmp_path):
    shutil.copy(golden(*CASES[0]), tmp_path)
    command = [sys.executable, str(HERE / "renew.py"), str(tmp_path)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert [line.split()[0] for line in said] == [golden(*case).name for case in CASES]
    assert "were no" not in said[0]
    assert all("were no" in line for line in said[1:])
    for case in CASES:
        written = golden(*case, tmp_path).read_text()
        chains = json.loads(written)
        assert len(written.splitlines()) == sum(len(chain["joints"]) + 1 for chain in chains)
        assert len(chains) == len(json.loads(golden(*case).read_text()))
