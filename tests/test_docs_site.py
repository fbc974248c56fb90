"""The site of the documentation: every page is in it, and its tables are whole."""

from __future__ import annotations

import re
from itertools import groupby
from typing import Any

import pytest
import yaml
from builders.paths import ROOT

import doo3d

CONFIG = ROOT / "docs" / "mkdocs.yml"
PAGES = ROOT / "docs" / "pages"


def pages(items: Any) -> list[str]:
    """Return the pages of a navigation, made of lists and {title: page or list}."""
    if isinstance(items, str):
        return [items]
    return [page for item in items for page in pages(list(item.values()) if isinstance(item, dict) else item)]


def test_every_page_is_in_the_navigation():
    site = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    assert sorted(pages(site["nav"])) == sorted(path.relative_to(PAGES).as_posix() for path in PAGES.rglob("*.md"))


def test_nothing_is_loaded_from_elsewhere():
    site = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    assert site["theme"]["font"] is False


def test_every_public_name_is_documented():
    page = (PAGES / "api.md").read_text(encoding="utf-8")
    assert {name for name in doo3d.__all__ if f"::: doo3d.{name}\n" not in page + "\n"} == set()


@pytest.mark.parametrize(
    "page",
    ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", *sorted(path.relative_to(ROOT).as_posix() for path in PAGES.rglob("*.md"))],
)
def test_every_table_has_a_heading_and_as_many_cells_in_each_line(page):
    lines = [re.sub("`[^`]*`", "", line) for line in (ROOT / page).read_text(encoding="utf-8").splitlines()]
    for is_table, rows in groupby(lines, lambda line: line.startswith("|")):
        if is_table:
            table = list(rows)
            assert set("".join(table[1:2])) == {"|", "-"}, table[0]
            assert len({len(re.findall(r"(?<!\\)\|", row)) for row in table}) == 1, table[0]
