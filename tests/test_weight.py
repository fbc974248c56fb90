"""The code lines of the project, in Python and C++ together: there may only be fewer."""

from __future__ import annotations

from builders.paths import ROOT

from doo3d.evaluation.benchmark.source_size import file_size, method_files

MOST = {"all": 45_021, "method": 17_177, "C++": 7_455, "tests": 33_077}
"""Lines without docstrings, comments and empty ones. Lower one when lines go; what is new needs something old to go."""


def lines(files):
    return sum(file_size(file).lines for file in files)


def test_there_are_no_more_lines_than_before():
    package = ROOT / "doo3d"
    method = method_files(package)
    found = {
        "all": lines(file for file in package.rglob("*") if file.suffix in (".py", ".cpp", ".h")),
        "method": lines(method),
        "C++": lines(file for file in method if file.suffix != ".py"),
        "tests": lines((ROOT / "tests").rglob("*.py")),
    }
    assert {name: count for name, count in found.items() if count > MOST[name]} == {}
