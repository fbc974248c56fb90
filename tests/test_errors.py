"""Errors: one family, and a missing package names the line that installs it."""

from __future__ import annotations

import ast
import pickle
import re

import pytest
from builders.errors import refuses
from builders.paths import ROOT

import doo3d
from doo3d.errors import ConfigError, DooError, InputError, MissingDependency, describe_error, error_code, require


def test_one_family():
    assert all(issubclass(kind, DooError) for kind in (ConfigError, InputError, MissingDependency))
    assert doo3d.DooError is DooError


def test_what_is_there_is_imported():
    assert require("json.decoder").JSONDecoder


@pytest.mark.parametrize(("extra", "line"), [(None, "pip install no_such_package_x"), ("view", "pip install 'doo3d[view]'")])
def test_what_is_missing_names_the_pip_line(extra, line):
    with refuses("missing-package", line, kind=MissingDependency):
        require("no_such_package_x.part", extra)


def test_public_names():
    for name in doo3d.__all__:
        assert getattr(doo3d, name)
        assert name in dir(doo3d)
    with pytest.raises(AttributeError, match="nothing_such"):
        _ = doo3d.nothing_such


def test_the_code_of_an_error_stays_with_it_when_it_crosses_processes():
    error = pickle.loads(pickle.dumps(InputError("mask has shape (1, 2)", code="mask-shape")))
    assert (type(error), str(error), error.code) == (InputError, "mask has shape (1, 2)", "mask-shape")


def test_an_exception_that_nobody_foresaw_names_its_type_and_line_and_has_a_code():
    with pytest.raises(ValueError, match="Empty module name") as caught:
        require("")
    assert error_code(caught.value) == "unexpected"
    assert describe_error(caught.value).startswith("ValueError at errors.py:")
    assert "report it" in describe_error(caught.value)
    refused = InputError("mask has shape (1, 2)", code="mask-shape")
    assert (describe_error(refused), error_code(refused)) == ("mask has shape (1, 2)", "mask-shape")


def test_a_remedy_names_arguments_in_the_words_of_the_reader():
    error = InputError("out {0}: is not empty", code="out-foreign", remedy="give another folder with -o, or --force")
    assert str(error) == "out {0}: is not empty: give another folder, or force=True"
    assert error.in_shell == "out {0}: is not empty: give another folder with -o, or --force"
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.in_shell, again.code) == (str(error), error.in_shell, "out-foreign")


def test_what_python_raises_speaks_of_no_option_of_a_run():
    """Texts in packages that Python calls for runs. Docstrings describe the shell as well, and remedies are put into Python."""
    for path in sorted((ROOT / "doo3d").rglob("*.py")):
        if path.relative_to(ROOT / "doo3d").parts[0] not in ("outputs", "runs", "exports", "compare", "sequence"):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        described = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        remedies = [node for node in ast.walk(tree) if isinstance(node, ast.keyword) and node.arg == "remedy"]
        described |= {id(part) for remedy in remedies for part in ast.walk(remedy)}
        texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
        for node in texts:
            found = re.search(r"--(restart|force|retry-failed|time-limit|workers|out)\b|with -o|\(-c image", node.value)
            assert found is None or id(node) in described, f"{path}:{node.lineno}: {node.value}"
