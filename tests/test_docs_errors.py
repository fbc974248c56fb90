"""The table of error codes in the documentation is complete and holds no other code."""

from __future__ import annotations

import re

from builders.paths import ROOT

PAGE = ROOT / "docs" / "pages" / "errors.md"
SOURCE = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "doo3d").rglob("*.py")))


def documented() -> set[str]:
    """Return the codes in the first column of the tables."""
    rows = re.findall(r"^\| (`.*?) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return {code for row in rows for code in re.findall(r"`([a-z0-9-]+)`", row)}


def test_every_code_that_is_raised_is_in_the_table():
    assert not set(re.findall(r'code="([a-z0-9-]+)"', SOURCE)) - documented()


def test_every_code_in_the_table_is_in_the_source():
    assert not {code for code in documented() if f'"{code}"' not in SOURCE and not code.endswith(("-missing",))}
