"""The numbers typed in the method, in Python and C++: each is a decision, and there may only be fewer."""

from __future__ import annotations

import textwrap

import pytest
from builders.paths import ROOT

from doo3d.evaluation.benchmark.source_size import SourceSize, file_size, method_files, size_of

MOST = 769
"""Lower it when numbers go; a new one needs an old one to go, and a docstring that names where its value comes from."""


def test_there_are_no_more_numbers_than_before():
    files = method_files(ROOT / "doo3d")  # an installation has no C++
    assert {".py", ".cpp"} <= {file.suffix for file in files}
    assert sum(file_size(file).numbers for file in files) <= MOST


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("A = 1", 0),
        ("A: float = -1.5", 1),
        ("A, B = 0.5, 3 * 4", 3),
        ("A = [3, (4, 5)]", 3),
        ("A = {'a': 0.1, 'b': np.array((0.2, 7))}", 3),
        ("A = True", 0),
        ("A = 'a'", 0),
        ("def f(a=1, *, b=0.5):\n    c = 9\n    return a + c", 1),
        ("class A:\n    b: float = 0.3", 1),
    ],
)
def test_a_number_is_typed_where_it_is_decided(tmp_path, text, numbers):
    (tmp_path / "a.py").write_text(text)
    assert file_size(tmp_path / "a.py").numbers == numbers


def test_lines_of_code_are_those_without_docstrings_comments_and_empty_ones(tmp_path):
    text = '''
    """Docstring
    of two lines."""

    # a comment
    A = (  # three lines
        1,
    )


    def f():
        """Return."""
        return A
    '''
    (tmp_path / "a.py").write_text(textwrap.dedent(text))
    assert file_size(tmp_path / "a.py") == SourceSize(5, 0)


def test_numbers_of_cpp_count_too(tmp_path):
    (tmp_path / "a.cpp").write_text(
        "constexpr int A = 7;\n    static constexpr double B = 2.0;  // 9.5\nconst double C = 0.3 + 3;\n"
    )
    assert file_size(tmp_path / "a.cpp") == SourceSize(3, 2)


def test_modules_are_added_up():
    assert size_of(["chains.fill", "skeleton.thin"]) == size_of(["chains.fill"]) + size_of(["skeleton.thin"])
