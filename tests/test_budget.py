"""The budget: the work of a frame, counted, may only shrink.

`budget.json` holds for five frames how many calls doo3d's code makes, how many elements the kernels look at (visits), how many
arrays of 400 kB or more are allocated (large; in a frame of four times the area: large around), and how many times the bytes of
the whole frame are looked through (scans). Times are not asserted: these numbers are the same at every run of one environment,
and time follows them.

Rules
-----
- No row may be above the recorded one. A change that lowers a row records it: `python tests/test_budget.py record`, 20 seconds.
- A row may rise only with a line in CHANGELOG.md that says which accuracy the work buys, and how much of it. `record --changelog
  LINE` checks that the line is there.
- Work follows the object: a frame of four times the area around the same object adds scans of its pixels and nothing else. Twice
  as many cables are at most 2.2 times the work.
- Counted is one interpretation of each frame: an uncertain one has up to three, and a hundredth of confidence decides that.
- A new kernel counts its visits (CONTRIBUTING.md). A new step first asks a fact whether it may matter; where it does not, it has
  hardly a visit.

In another environment, with another Python, NumPy or processor, a last bit or a version moves some counts; there the rows are
compared with an allowance of 2 %: with Python 3.12 and NumPy 2.5 for 3.11 and 2.4 the visits stay, and calls change by 0.4 %.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from builders.frames import doubled, padded
from builders.work import NAMES, SURROUNDINGS, environment, large_arrays_of, work_of

from doo3d.runs.threads import single_thread

FILE = Path(__file__).with_name("budget.json")
CHANGELOG = Path(__file__).parents[1] / "CHANGELOG.md"
WITHOUT_MASK = "crossing"
"""The frame in which the object has to be found: its work follows the frame, too."""

ELSEWHERE = 1.02
"""Times the recorded row that is allowed in another environment."""

LAST_BIT = 1e-6
"""Share by which a row may rise in the same environment: processors with the same instructions can differ in a last bit, and that
moved 1 of 5.3 million visits."""

MOST_OF_TWICE = 2.2
"""Times the work that twice as many cables may take."""


def counts() -> dict[str, dict[str, Any]]:
    """Return the counts of each frame, of the frame with four times the area around it, and of its cables twice."""
    from doo3d import detect, load_config
    from doo3d.judge import interpretations
    from doo3d.tools.bench_cases import CASES

    interpretations.OTHERS = ()
    result = {}
    for case in (case for case in CASES if case.name in NAMES):
        frame, config = case.make(), load_config(case.preset or "default")

        def work(data: Any, mask: Any, config: Any = config) -> dict[str, int]:
            return asdict(work_of(lambda: detect(data, config, mask)))

        row: dict[str, Any] = work(frame.data, frame.mask)
        twice = work(*doubled(frame.data, frame.mask))
        row["twice"] = {name: twice[name] / row[name] for name in ("calls", "visits")}
        if hasattr(frame.data, "color") and not hasattr(frame.data, "points"):
            around, added = padded(frame.data, frame.mask)
            larger = work(*around)
            row["scans"] = round(8 * (larger["visits"] - row["visits"]) / added, 2)
            row["large around"] = larger["large"]
        result[case.name] = row
    return result


def _print_large_arrays() -> None:
    """Print for each frame the lines of doo3d that allocate large arrays, and how many."""
    from doo3d import detect, load_config
    from doo3d.tools.bench_cases import CASES

    for case in (case for case in CASES if case.name in NAMES):
        frame, config = case.make(), load_config(case.preset or "default")
        detect(frame.data, config, frame.mask)
        print(case.name)  # noqa: T201
        for place, count in large_arrays_of(lambda: detect(frame.data, config, frame.mask)).most_common():  # noqa: B023
            print(f"{count:>4} {place}")  # noqa: T201


def above(found: dict[str, Any], recorded: dict[str, Any], same: bool) -> Iterator[str]:
    """Yield a sentence for each row that is above the recorded one; `same` tells whether that is of the same environment."""
    for name, row in found.items():
        for what, most in recorded[name].items():
            allowed = most + int(LAST_BIT * most) if same else math.ceil(most * ELSEWHERE)
            if row[what] > allowed:
                yield f"{name}: {row[what]} {what}, and {most} are recorded"


def recorded_rows() -> dict[str, Any]:
    """Return the recorded table: "environment", and the rows by name."""
    return json.loads(FILE.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    """The counts, by a process of its own: here other tests have imported and cached things."""
    command = [sys.executable, __file__, "count"]
    done = subprocess.run(command, env=SURROUNDINGS, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_no_row_is_above_the_recorded_one(found):
    recorded = recorded_rows()
    same = recorded.pop("environment") == environment()
    assert set(found) == set(recorded) == set(NAMES)
    sentences = list(above(found, recorded, same))
    assert not sentences, "\n".join(sentences)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name != WITHOUT_MASK and "points" not in name])
def test_a_larger_frame_around_the_object_adds_scans_only(found, name):
    """Of a frame of four times the area the kernels look at the same elements, and some whole times through its bytes."""
    scans = found[name]["scans"]
    assert scans == round(scans) or scans < 0  # a photograph of four times the area is worked on reduced


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_twice_as_many_cables_are_about_twice_the_work(found, name):
    assert max(found[name]["twice"].values()) <= MOST_OF_TWICE


def test_rows_above_are_named():
    recorded = {"a": {"calls": 100, "large": 1}, "b": {"calls": 10}}
    found = {"a": {"calls": 102, "large": 2}, "b": {"calls": 9}}
    assert list(above(found, recorded, True)) == ["a: 102 calls, and 100 are recorded", "a: 2 large, and 1 are recorded"]
    assert list(above(found, recorded, False)) == []


def test_calls_and_large_arrays_are_counted():
    import numpy as np

    from doo3d.geometry.polyline import arc_length
    from doo3d.kernels import thin_pixels

    line, pixels = np.zeros((5, 2)), np.argwhere(np.ones((9, 30))) + 1
    for work in (lambda: arc_length(line), lambda: thin_pixels(pixels)):
        one, two = work_of(work), work_of(lambda work=work: (work(), work()))
        assert one.calls + one.visits > 0
        assert (two.calls, two.visits) == (2 * one.calls, 2 * one.visits)
    assert one.visits > len(pixels)
    arrays = work_of(lambda: (np.zeros(49_999), np.zeros(50_000), np.ones((500, 900), bool), np.empty(10)))
    assert (arrays.calls, arrays.visits, arrays.large) == (0, 0, 2)


def main(arguments: list[str] | None = None) -> int:
    """Print the counts, or record them; 1 where a row rises without a line of the changelog."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("count", "large", "record"), help="large: the lines that allocate large arrays")
    parser.add_argument("--changelog", metavar="LINE", help="words of the line of CHANGELOG.md that says what higher rows buy")
    chosen = parser.parse_args(arguments)
    if chosen.action == "large":
        _print_large_arrays()
        return 0
    found = counts()
    if chosen.action == "count":
        print(json.dumps(found))  # noqa: T201
        return 0
    recorded = recorded_rows() if FILE.exists() else {"environment": ""}
    same = recorded.pop("environment") == environment()
    sentences = list(above({name: row for name, row in found.items() if name in recorded}, recorded, same))
    for sentence in sentences:
        print(sentence)  # noqa: T201
    if sentences and not (chosen.changelog and chosen.changelog in CHANGELOG.read_text(encoding="utf-8")):
        print("rows rise: give words of their line in CHANGELOG.md by --changelog; nothing is recorded")  # noqa: T201
        return 1
    rows = {name: {what: value for what, value in row.items() if what != "twice"} for name, row in found.items()}
    lines = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in ({"environment": environment()} | rows).items()]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    if os.environ.get("PYTHONHASHSEED") != "0":
        sys.exit(subprocess.run([sys.executable, *sys.argv], env=SURROUNDINGS).returncode)
    single_thread()
    sys.exit(main())
