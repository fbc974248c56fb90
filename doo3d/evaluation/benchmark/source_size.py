"""Measure the size of the source code: lines of code and typed numbers, in Python and C++."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

METHOD = (
    "kernels",
    "geometry",
    "scene",
    "segment",
    "skeleton",
    "chains",
    "links",
    "judge",
    "pipeline.py",
    "track",
    "fusion",
    "camera",
)
"""Packages and modules of `doo3d` that make up the method; the others read, write, draw and measure."""

_CPP_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.S)
_CPP_CONSTANT = re.compile(r"\s*(?:static\s+|inline\s+)*constexpr\b[^(]*=")
_CPP_FLOAT, _CPP_NUMBER = (
    re.compile(rf"(?<![\w.])(?:\d+\.\d*(?:e-?\d+)?f?|\d+e-?\d+f?{whole})(?![\w.])") for whole in ("", r"|\d+")
)
_HARMLESS = {0.0, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0}
_SKIPPED = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)


class SourceSize(NamedTuple):
    """The size of a piece of source code.

    Attributes
    ----------
    lines
        number of lines with code; docstrings, comments and empty lines do not count.
    numbers
        number of numeric literals. In Python: those at module level and in class bodies, also inside tuples, dicts and calls, and
        defaults of arguments, except whole numbers from -2 to 2. In C++: those of a `constexpr`, and all with a decimal point
        except a few simple ones.
    """

    lines: int
    numbers: int

    def __add__(self, other: tuple[int, ...]) -> SourceSize:  # type: ignore[override]
        """Return the sum of two sizes."""
        return SourceSize(self.lines + other[0], self.numbers + other[1])


def method_files(root: Path | None = None) -> list[Path]:
    """Return the source files of the method: Python files in order of their paths, then C++ files if they exist.

    root : folder of the package; None for the installed one, which mostly has no C++ sources.
    """
    root = root or _root()
    python = [file for file in sorted(root.rglob("*.py")) if file.relative_to(root).parts[0] in METHOD]
    return python + sorted(file for ending in ("*.cpp", "*.h") for file in (root / "kernels" / "src").rglob(ending))


def size_of(modules: Iterable[str]) -> SourceSize:
    """Return the total size of modules of `doo3d`, named as in "segment.mask_repair".

    Raises
    ------
    FileNotFoundError : there is no such module.
    """
    return sum((file_size(_root() / f"{name.replace('.', '/')}.py") for name in modules), SourceSize(0, 0))


def file_size(file: Path) -> SourceSize:
    """Return the size of one file of Python or C++."""
    text = file.read_text(encoding="utf-8")
    if file.suffix != ".py":
        lines = [line for line in _CPP_COMMENT.sub(lambda found: "\n" * found[0].count("\n"), text).splitlines() if line.strip()]
        found = [each for line in lines for each in (_CPP_NUMBER if _CPP_CONSTANT.match(line) else _CPP_FLOAT).findall(line)]
        return SourceSize(len(lines), sum(float(each.rstrip("f")) not in _HARMLESS for each in found))
    tree = ast.parse(text)
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    code = {token.start[0] for token in tokens if token.type not in _SKIPPED}
    return SourceSize(len(code - _docstring_lines(tree)), sum(map(_numbers_in, _decisions(tree))))


def _root() -> Path:
    spec = find_spec("doo3d")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent


def _decisions(tree: ast.AST) -> Iterator[ast.expr]:
    """Yield the expressions assigned at module level and in class bodies, and the defaults of arguments."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef):
            yield from (
                each.value for each in node.body if isinstance(each, ast.Assign | ast.AnnAssign) and each.value is not None
            )
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from (each for each in (*node.args.defaults, *node.args.kw_defaults) if each is not None)


def _numbers_in(value: ast.expr) -> int:
    """Return the number of numeric literals in an expression, except whole numbers from -2 to 2."""
    typed = [each.value for each in ast.walk(value) if isinstance(each, ast.Constant)]
    numbers = [each for each in typed if isinstance(each, int | float) and not isinstance(each, bool)]
    return sum(isinstance(each, float) or abs(each) > 2 for each in numbers)


def _docstring_lines(tree: ast.AST) -> set[int]:
    lines: set[int] = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for each in body if isinstance(body, list) else []:
            if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant) and isinstance(each.value.value, str):
                lines |= set(range(each.lineno, (each.end_lineno or each.lineno) + 1))
    return lines
