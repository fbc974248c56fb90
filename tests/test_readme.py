"""Every command and every piece of Python in the README, CONTRIBUTING and docs/ is run, page after page in one folder."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from builders.paths import ROOT

NAV = re.findall(r": (\S+\.md)$", (ROOT / "docs" / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
ORDER = [ROOT / "README.md", *(ROOT / "docs" / "pages" / name for name in NAV)]
"""The pages as a reader meets them."""

PAGES = list(dict.fromkeys([*ORDER, ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]))
NOT_RUN = ("pip install", "pytest", "ruff", "mypy", "#")  # installing, and the tests themselves
LANGUAGES = {"sh", "python", "text", "json", "yaml", "toml"}
STAND_INS = ROOT / "tests" / "builders" / "stand_ins"  # of modules that no test can have, such as the drivers of cameras
TEST_COMMAND = "pip install '.[test]' && pytest"
IN_A_SHELL = {"README.md", "first-steps.md"}  # typed word for word; those of other pages run in this process, which is faster
REPEATS = r"--(seeds|runs) \d+"  # of measurements: once shows that the command works
HOME = "https://github.com/doo3d/doo3d"  # the README is shown elsewhere, too, so its links are absolute
ELISION = "..."  # a line of shown output that stands for any number of lines


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the fenced blocks of a page, in order."""
    return re.findall(r"^ *```(\w*)\n(.*?)^ *```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def shell_lines(text: str) -> list[str]:
    """Return the lines of a shell block without comments and blank lines."""
    return [line.split(" #")[0].strip() for line in text.splitlines() if line.split(" #")[0].strip()]


def runnable(block: str) -> list[str]:
    """Return the commands of a shell block that are to be run, in order."""
    parts = [part.strip() for line in shell_lines(block) for part in line.split("&&")]
    return [small(part) for part in parts if not part.startswith(NOT_RUN)]


def small(command: str) -> str:
    """Return a command with a measurement on many large scenes made one on a small scene of each kind."""
    size = " --size 320x180" if command.startswith("doo3d evaluate scenes") and "--size" not in command else ""
    return re.sub(REPEATS, r"--\1 1", command) + size


def commands(page: Path) -> list[str]:
    """Return the commands of a page's shell blocks that are to be run, in order."""
    return [command for language, text in blocks(page) if language == "sh" for command in runnable(text)]


def script(page: Path) -> str:
    """Return all Python blocks of a page as one program."""
    return "\n".join(text for language, text in blocks(page) if language == "python")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the samples, as the checkout has them; a reader stays in it from page to page."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "sample_clouds", folder / "sample_clouds")
    return folder


def run(command: list[str], folder: Path) -> str:
    """Run a command in the folder with this Python's programs first in the path, and return what it printed."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    places = os.pathsep.join(filter(None, [str(STAND_INS), os.environ.get("PYTHONPATH")]))
    surroundings = os.environ | {"PATH": path, "PYTHONPATH": places}
    done = subprocess.run(command, cwd=folder, env=surroundings, capture_output=True, text=True, encoding="utf-8")
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def run_python(program: str, folder: Path) -> str:
    """Run a Python program in the folder, where drivers of cameras are stand-ins, and return what it printed."""
    return run([sys.executable, "-W", "error", "-c", program], folder)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_blocks_have_a_known_language(page):
    assert {language for language, _ in blocks(page)} <= LANGUAGES


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if commands(page) or script(page)], ids=lambda page: page.name)
def test_commands_and_then_python_run_and_print_what_is_shown(page, folder, doo3d, monkeypatch):
    """Each text block right after a shell block of the README is what the last command of that block prints."""
    printed = ""
    monkeypatch.chdir(folder)
    for language, text in blocks(page):
        for command in runnable(text) if language == "sh" else []:
            program, *words = shlex.split(command)
            if page.name in IN_A_SHELL or program != "doo3d" or ">" in words:
                printed = run(["bash", "-c", command], folder)
            else:
                code, printed, said = doo3d(*words)
                assert code == 0, f"{command}\n{printed}\n{said}"
        if language == "text" and page.name == "README.md":
            assert re.fullmatch(shown_pattern(text), blurred(printed)), f"{text}\nis shown, printed is\n{printed}"
    if script(page):
        run_python(script(page), folder)


def blurred(text: str) -> str:
    """Return printed text with each number as 0: numbers may move with the versions of the libraries, words and order may not."""
    return re.sub(r"\d+", "0", text)


def shown_pattern(text: str) -> str:
    """Return the regular expression of shown output, for `blurred` output."""
    lines = blurred(text).splitlines(keepends=True)
    return "".join("(?:.*\n)*?" if line.strip() == ELISION else re.escape(line) for line in lines)


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
        target = re.sub(f"^{HOME}/(blob|raw)/main/", f"{ROOT}/", target)
        if "://" in target:
            continue
        other = page.parent / target if target else page
        assert other.exists(), target
        if anchor and not anchor.startswith("doo3d."):  # of the Python API, which only the site has
            assert anchor in anchors(other), f"{target}#{anchor}"


def test_pictures_are_small():
    for picture in (ROOT / "docs" / "pages" / "images").rglob("*.*"):
        assert picture.stat().st_size < (1_500_000 if picture.suffix == ".webp" else 150_000), picture


def test_the_readme_is_short_and_begins_with_a_command():
    readme = ROOT / "README.md"
    text = readme.read_text(encoding="utf-8")
    assert (len(text.split()) <= 750, len(text.splitlines()) <= 120) == (True, True)
    assert not re.findall(r"\]\((?!https://)[^)]*\)", prose(readme))
    assert f'Homepage = "{HOME}"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert blocks(readme)[0][0] == "sh"
    assert len(re.findall(rf"^\|.*\]\({HOME}/blob/main/docs/pages/", prose(readme), re.MULTILINE)) == 9


def test_every_picture_is_shown():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    images = ROOT / "docs" / "pages" / "images"
    assert not [path for path in images.rglob("*.*") if f"images/{path.relative_to(images).as_posix()}" not in text]


def test_one_command_draws_every_picture_of_the_documentation(tmp_path):
    """Each script of docs/figures is one of its commands; `figures` has their helpers."""
    figures = ROOT / "docs" / "figures"
    spec = importlib.util.spec_from_file_location("all_figures", figures / "all.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    run = {Path(command[1]).stem for command in module.commands(tmp_path) if command[1].endswith(".py")}
    assert run == {file.stem for file in figures.glob("*.py")} - {"all", "figures"}
