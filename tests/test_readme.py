"""Every command and every piece of Python in the README, CONTRIBUTING and docs/ is run, in a copy of what a user has."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from builders.paths import ROOT

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
NOT_RUN = ("pip install", "pytest", "ruff", "mypy", "#")  # installing, and the tests themselves
LANGUAGES = {"sh", "python", "text", "json", "yaml", "toml"}
TEST_COMMAND = "pip install '.[test]' && pytest"


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the fenced blocks of a page, in order."""
    return re.findall(r"^ *```(\w*)\n(.*?)^ *```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def shell_lines(text: str) -> list[str]:
    """Return the lines of a shell block without comments and blank lines."""
    return [line.split(" #")[0].strip() for line in text.splitlines() if line.split(" #")[0].strip()]


def commands(page: Path) -> list[str]:
    """Return the commands of a page's shell blocks that are to be run, in order."""
    lines = [line for language, text in blocks(page) if language == "sh" for line in shell_lines(text)]
    parts = [part.strip() for line in lines for part in line.split("&&")]
    return [part for part in parts if not part.startswith(NOT_RUN)]


def script(page: Path) -> str:
    """Return all Python blocks of a page as one program."""
    return "\n".join(text for language, text in blocks(page) if language == "python")


@pytest.fixture
def folder(tmp_path):
    """A folder with the samples, as the checkout has them."""
    shutil.copytree(ROOT / "sample_clouds", tmp_path / "sample_clouds")
    return tmp_path


def run(command: list[str], folder: Path) -> str:
    """Run a command in the folder with this Python's programs first in the path, and return what it printed."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(command, cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_blocks_have_a_known_language(page):
    assert {language for language, _ in blocks(page)} <= LANGUAGES


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if commands(page) or script(page)], ids=lambda page: page.name)
def test_commands_and_then_python_run(page, folder):
    for command in commands(page):
        run(["bash", "-c", command], folder)
    if script(page):
        run([sys.executable, "-W", "error", "-c", script(page)], folder)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_install_lines_name_extras_that_exist(page):
    extras = metadata.metadata("doo3d").get_all("Provides-Extra") or []
    for language, text in blocks(page):
        for line in shell_lines(text) if language == "sh" else []:
            for wanted in re.findall(r"pip install (\S+)", line):
                found = re.fullmatch(r"'?\.(?:\[([\w,]+)\])?'?", wanted)
                assert found, line
                assert set((found.group(1) or "").split(",")) - {""} <= set(extras), line


def test_the_test_command_is_the_one_that_ci_runs():
    readme = [line for language, text in blocks(ROOT / "README.md") if language == "sh" for line in shell_lines(text)]
    assert TEST_COMMAND in readme
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert TEST_COMMAND in ci.replace("pip install --quiet", "pip install")


@pytest.mark.slow
def test_the_output_shown_is_the_output(folder):
    """Numbers may move with the versions of the libraries; words, order and number of lines may not."""
    shown = next(text for language, text in blocks(ROOT / "README.md") if language == "text")
    given = run(["doo3d", "detect", "sample_clouds/crossing", "-o", "out"], folder)
    assert re.sub(r"\d+", "0", given) == re.sub(r"\d+", "0", shown)


def prose(page: Path) -> str:
    """Return the text of a page without its fenced blocks."""
    return re.sub(r"^ *```.*?^ *```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and MkDocs make them."""
    headings = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)]
    return {heading.replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_are_there(page):
    for target, _, anchor in re.findall(r"\]\(([^)#\s]*)(#([^)]*))?\)", prose(page)):
        if "://" in target:
            continue
        other = page.parent / target if target else page
        assert other.exists(), target
        if anchor and not anchor.startswith("doo3d."):  # of the Python API, which only the site has
            assert anchor in anchors(other), f"{target}#{anchor}"


def test_pictures_are_small():
    for picture in (ROOT / "docs" / "pages" / "images").rglob("*.*"):
        assert picture.stat().st_size < 150_000, picture


def test_every_picture_is_shown():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    images = ROOT / "docs" / "pages" / "images"
    assert not [path for path in images.rglob("*.*") if f"images/{path.relative_to(images).as_posix()}" not in text]
