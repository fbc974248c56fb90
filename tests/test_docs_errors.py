"""The table of error codes in the documentation is complete and holds no other code."""

from __future__ import annotations

import ast
import re

from builders.paths import ROOT

PAGE = ROOT / "docs" / "pages" / "errors.md"
SOURCE = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "doo3d").rglob("*.py")))


def documented() -> set[str]:
    """Return the codes in the first column of the tables."""
    rows = re.findall(r"^\| (`.*?) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return {code for row in rows for code in re.findall(r"`([a-z0-9-]+)`", row)}


def raised() -> set[str]:
    """Return the codes that are given as an argument `code`, also where one of two is chosen."""
    given = [node.value for node in ast.walk(ast.parse(SOURCE)) if isinstance(node, ast.keyword) and node.arg == "code"]
    chosen = [branch for value in given if isinstance(value, ast.IfExp) for branch in (value.body, value.orelse)]
    return {value.value for value in given + chosen if isinstance(value, ast.Constant) and isinstance(value.value, str)}


def test_every_code_that_is_raised_is_in_the_table():
    assert len(raised()) > 150
    assert not raised() - documented()


def test_every_code_in_the_table_is_in_the_source():
    assert not {code for code in documented() if f'"{code}"' not in SOURCE and not code.endswith(("-missing",))}
