"""Pages of the documentation can be followed one after the other in one folder: no command meets what another has written."""

from __future__ import annotations

import shlex

import pytest
from test_readme import ORDER, ROOT, commands

PAGES = ROOT / "docs" / "pages"
RUNS_RESUME = "detect"
MAY_REPLACE = ("evaluate", "bench", "info")


def default_of(words: list[str]) -> str | None:
    """Return what a command writes that no name is given for; None if it writes nothing."""
    if words[1] == "report":
        return words[2] + ".html"
    if words[1] == "video":
        return words[2] + ".webm"
    if words[1] == "export" and "--to" in words and "--list" not in words:
        return words[2] + "." + words[words.index("--to") + 1]
    return None


def written(command: str) -> tuple[str, list[str]] | None:
    """Return the target of a command, and its words; None if it writes nothing."""
    words = shlex.split(command)
    if words[0] != "doo3d" or len(words) < 3 or words[1] in MAY_REPLACE:
        return None
    named = [words[i + 1] for i, word in enumerate(words[:-1]) if word in ("-o", "--out", "--save", "--json")]
    target = named[0] if named else default_of(words)
    return None if target is None else (target, sorted(words))


def test_a_collision_is_found():
    assert written("doo3d report out") == ("out.html", sorted(["doo3d", "report", "out"]))
    assert written("doo3d detect a -o out")[0] == "out"
    assert written("doo3d config") is None


@pytest.mark.parametrize("target", sorted({found[0] for page in ORDER for each in commands(page) if (found := written(each))}))
def test_nothing_is_written_twice(target):
    """The same run may be asked for again, since it resumes."""
    writers = [
        (page.name, words)
        for page in ORDER
        for each in commands(page)
        if (found := written(each))
        for words in [found[1]]
        if found[0] == target
    ]
    if RUNS_RESUME in writers[0][1]:
        assert len({tuple(words) for _, words in writers}) == 1, writers
    else:
        assert len(writers) == 1, writers
