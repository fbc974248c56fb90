"""The 3-D mode finds in the samples and in rendered scenes what it found before: `python tests/golden/chains.py compare`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from golden.chains import FILE, GUARDED, MOVED, difference, outcome, samples, scenes

KNOWN = json.loads(FILE.read_text(encoding="utf-8"))
SAMPLES = dict(samples())
SCENES = {name: run for name, run in scenes(1, None) if name.endswith("given")}


def check(name, detection):
    """The same numbers of joints, and the middle of every chain where it was, as far as machines agree."""
    old, new = KNOWN[name]["joints"], outcome(detection)["joints"]
    assert [row[0] for row in new] == [row[0] for row in old]
    for was, now in zip(old, new, strict=True):
        np.testing.assert_allclose(now[1:], was[1:], atol=MOVED)


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_are_as_before(name):
    check(name, SAMPLES[name]())


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_scenes_are_as_before(name):
    check(name, SCENES[name]())


def test_every_family_is_guarded():
    families = {name.split("/")[1] for name in KNOWN if name.startswith("scenes/")}
    assert families == set(GUARDED)


def test_differences_in_words():
    old = {"chains": "a", "confidence": "c", "joints": [[3, 0.0, 0.0, 1.0]]}
    assert difference(old, old) == ""
    assert difference(None, old) == "is new"
    assert difference(old, old | {"confidence": "d"}) == "confidence changed"
    assert difference(old, old | {"chains": "b"}) == "a last bit, a flag or a crossing changed"
    assert "0.5" in difference(old, old | {"chains": "b", "joints": [[3, 0.5, 0.0, 1.0]]})
    assert "[3] before, [4] now" in difference(old, old | {"chains": "b", "joints": [[4, 0.0, 0.0, 1.0]]})
