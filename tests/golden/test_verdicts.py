"""Verdicts are recorded once, and compared kind by kind: `python tests/golden/verdicts.py`."""

from __future__ import annotations

from functools import partial

import pytest
from golden.verdicts import Work, changes, record, summary, works

LEFT, RIGHT = [[0, 0, 0]] * 8, [[0, 30, 40]] * 8


def verdicts(*rows):
    return {"a kind": {f"frame {k}": list(row) for k, row in enumerate(rows)}}


def test_a_table_of_what_changed():
    before = verdicts((1, 1, 1, LEFT), (1, 1, 1, LEFT), (0, 0, 2, LEFT), (0, 1, 1, []))
    after = verdicts((1, 1, 1, RIGHT), (0, 1, 1, LEFT), (1, 1, 1, LEFT), (1, 1, 1, LEFT))
    kind, total = summary(before, after).splitlines()[1:]
    assert kind.split()[:8] == ["a", "kind", "4", "2", "3", "+2", "-1", "1.000"]
    assert kind.split()[8:12] == ["3", "4", "+1", "-0"]
    assert kind.endswith("5.0 mm")
    assert total.split()[0] == "all"
    assert len(changes(before, after)) == 3


def verdict(seen, name):
    seen.append(name)
    return [[1, 1, 0, []]]


def test_what_is_recorded_is_not_run_again(tmp_path, monkeypatch):
    monkeypatch.setattr("golden.verdicts.ProcessPoolExecutor", Inline)
    seen = []
    chosen = [Work("a kind", (name,), partial(verdict, seen, name)) for name in ("one", "two")]
    record(tmp_path / "found.json.xz", chosen[:1], 1)
    assert set(record(tmp_path / "found.json.xz", chosen, 1)["a kind"]) == {"one", "two"}
    assert seen == ["one", "two"]


class Inline:
    """In place of processes."""

    def __init__(self, workers):
        self.map = map

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


def test_the_frames():
    counts = {}
    for work in works(None, None):
        counts[work.kind] = counts.get(work.kind, 0) + len(work.names)
    assert sum(count for kind, count in counts.items() if "mask" in kind and "branched" not in kind) >= 744
    assert sum(count for kind, count in counts.items() if "sequences" in kind) == 600
    assert counts["stereo, nothing"] + counts["d435, nothing"] >= 324
    assert counts["stereo, no cable"] + counts["d435, no cable"] == 216


@pytest.mark.parametrize("arguments", [["record", "a", "b"], ["compare", "a", "b", "c"]])
def test_too_many_files(arguments, capsys):
    from golden.verdicts import main

    with pytest.raises(SystemExit):
        main(arguments)
    assert "two at most" in capsys.readouterr().err
