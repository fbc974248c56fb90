"""The benchmark: its measurements and its table. No test asserts a duration."""

from __future__ import annotations

import pytest
from builders.errors import refuses

from doo3d.config import Config, load_config
from doo3d.tools import benchmark as bench


def test_stages_and_total(capture):
    (timing,) = bench.bench([capture()], load_config("default"), 3)
    assert timing.size == "320x240"
    assert timing.runs == 3
    assert timing.chains == 1
    assert next(iter(timing.stages)) == "segment"
    assert list(timing.stages)[-1] == "total"
    assert all(0 <= median <= late for median, late in timing.stages.values())
    parts = sum(median for stage, (median, _) in timing.stages.items() if stage != "total")
    assert parts > 0
    text = "\n".join(timing.lines())
    total = next(line for line in timing.lines() if line.startswith("total")).split()
    assert float(total[3]) == pytest.approx(timing.stages["total"][0] / timing.yardstick, abs=0.06)
    for word in (
        "320x240",
        "3 runs",
        "one thread",
        "median",
        "95 %",
        "yardsticks",
        "thin",
        "total",
        f"yardstick {timing.yardstick:.2f} ms",
    ):
        assert word in text


def test_captures_that_cannot_be_read(tmp_path):
    with refuses("file-missing", "nowhere"):
        bench.bench([tmp_path / "nowhere"], Config(), 1)


def test_memory_is_at_least_what_is_held():
    held = bytearray(200 << 20)
    peak = bench.peak_memory_mb()
    assert len(held)
    assert peak is None or peak > 200
