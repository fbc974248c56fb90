"""The supported versions of Python agree everywhere, and the table of sizes is of the packages that are needed."""

from __future__ import annotations

import importlib.util
import re

from builders.paths import ROOT

PAGE = (ROOT / "docs" / "pages" / "installation.md").read_text(encoding="utf-8")
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_the_versions_of_python_are_tested():
    supported = set(re.findall(r'"Programming Language :: Python :: (3\.\d+)"', PROJECT))
    tests = (ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8")
    assert supported == {"3.10", "3.11", "3.12", "3.13"}
    assert supported <= set(re.findall(r'"(3\.\d+)"', tests))
    assert "Python 3.10 to 3.13" in PAGE


def test_every_extra_is_explained():
    extras = set(
        re.findall(r"^([a-z0-9]+) = \[", PROJECT[PROJECT.index("[project.optional") :].split("[project.scripts]")[0], re.M)
    )
    assert extras <= set(re.findall(r"`(\w+)`", PAGE[PAGE.index("## Extras") :]))


def test_the_table_of_sizes_can_be_made():
    spec = importlib.util.spec_from_file_location("installation_size", ROOT / "docs" / "installation_size.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    table = module.table()
    assert "| `numpy` |" in table
    assert re.search(r"\*\*all\*\* \| \*\*\d{3,}\*\*", table)
    assert module.name_of("opencv-python-headless>=4.8") == "opencv-python-headless"
    assert module.name_of("Jinja2[x] ; python_version > '3'") == "jinja2"
