"""Every command and every piece of Python in the README and in docs/ is run, in a copy of what a user has."""

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

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LANGUAGES = {"sh", "python", "text", "json", "yaml"}
TEST_COMMAND = "pip install '.[test]' && pytest"


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the fenced blocks of a page, in order."""
    return re.findall(r"^ *```(\w*)\n(.*?)^ *```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def shell_lines(text: str) -> list[str]:
    return [line.split(" #")[0].strip() for line in text.splitlines() if line.split(" #")[0].strip()]


def commands(page: Path) -> list[str]:
    """What is to be run of the shell blocks: all but installing and the whole test suite."""
    lines = [line for language, text in blocks(page) if language == "sh" for line in shell_lines(text)]
    parts = [part.strip() for line in lines for part in line.split("&&")]
    return [part for part in parts if not part.startswith(("pip install", "#")) and part != "pytest"]


@pytest.fixture
def place(tmp_path):
    """A folder with the samples, as the checkout has them."""
    shutil.copytree(ROOT / "sample_clouds", tmp_path / "sample_clouds")
    return tmp_path


def run(command: list[str], place: Path) -> str:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(command, cwd=place, env=os.environ | {"PATH": path}, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_blocks_say_what_they_are(page):
    assert {language for language, _ in blocks(page)} <= LANGUAGES


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.name)
def test_commands_run(page, place):
    for command in commands(page):
        run(["bash", "-c", command], place)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if any(kind == "python" for kind, _ in blocks(page))], ids=lambda page: page.name
)
def test_python_runs(page, place):
    script = "\n".join(text for language, text in blocks(page) if language == "python")
    run([sys.executable, "-W", "error", "-c", script], place)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_install_lines_name_what_there_is(page):
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


def test_the_output_shown_is_what_comes_out(place):
    """Numbers may move with the versions of the libraries; words, order and number of lines may not."""
    shown = next(text for language, text in blocks(ROOT / "README.md") if language == "text")
    given = run(["doo3d", "detect", "sample_clouds/crossing", "-o", "out"], place)
    assert re.sub(r"\d+", "0", given) == re.sub(r"\d+", "0", shown)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_are_there(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text) + re.findall(r'src="([^"]+)"', text):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_pictures_are_small():
    for picture in (ROOT / "docs" / "images").glob("*"):
        assert picture.stat().st_size < 150_000, picture
