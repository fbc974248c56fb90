"""The site of the documentation: every page is in it."""

from __future__ import annotations

from typing import Any

import yaml
from builders.paths import ROOT

DOCS = ROOT / "docs"


def pages(items: Any) -> list[str]:
    """The pages of a navigation, of lists and {title: page or list}."""
    if isinstance(items, str):
        return [items]
    return [page for item in items for page in pages(list(item.values()) if isinstance(item, dict) else item)]


def test_every_page_is_in_the_navigation():
    site = yaml.safe_load((DOCS / "site" / "mkdocs.yml").read_text(encoding="utf-8"))
    assert sorted(pages(site["nav"])) == sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))


def test_nothing_is_loaded_from_elsewhere():
    site = yaml.safe_load((DOCS / "site" / "mkdocs.yml").read_text(encoding="utf-8"))
    assert site["theme"]["font"] is False
