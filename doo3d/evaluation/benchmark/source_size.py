"""The size of the method: lines of code, and numbers typed at the top of a module."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

METHOD = ("facts", "evidence", "stages", "geometry", "sequence", "pipeline.py", "visibility.py")
"""Packages and modules of `doo3d` in which the method is; the rest reads, writes, draws and measures."""

_CPP_NUMBER = re.compile(r"^\s*(?:static\s+|inline\s+)*constexpr\s+\w[\w:<>]*\s+\w+\s*=", re.M)
_SKIPPED = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)


class SourceSize(NamedTuple):
    """How large a piece of source code is.

    Attributes
    ----------
    lines
        lines with code on them; docstrings, comments and empty lines are not.
    numbers
        assignments of a number, or of a tuple of numbers, at the top of a Python module; `constexpr` in C++.
    """

    lines: int
    numbers: int

    def __add__(self, other: tuple[int, ...]) -> SourceSize:  # type: ignore[override]
        """Return the size of both together."""
        return SourceSize(self.lines + other[0], self.numbers + other[1])


def method_files(root: Path | None = None) -> list[Path]:
    """Return the source files of the method, Python in order of their paths, then C++ if the sources are at hand.

    root : the package; None for that which is installed, mostly without C++.
    """
    root = root or _root()
    python = [file for file in sorted(root.rglob("*.py")) if file.relative_to(root).parts[0] in METHOD]
    return python + sorted(file for ending in ("*.cpp", "*.h") for file in (root / "kernels" / "src").glob(ending))


def size_of(modules: Iterable[str]) -> SourceSize:
    """Return the size of modules named as `stages.segment.mask_repair`, that is in `doo3d`.

    Raises
    ------
    FileNotFoundError : there is no such module.
    """
    return sum((file_size(_root() / f"{name.replace('.', '/')}.py") for name in modules), SourceSize(0, 0))


def file_size(file: Path) -> SourceSize:
    """Return the size of one file of Python or C++."""
    text = file.read_text(encoding="utf-8")
    if file.suffix != ".py":
        return SourceSize(text.count("\n"), len(_CPP_NUMBER.findall(text)))
    tree = ast.parse(text)
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    code = {token.start[0] for token in tokens if token.type not in _SKIPPED}
    numbers = sum(
        isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None and _is_number(node.value) for node in tree.body
    )
    return SourceSize(len(code - _docstring_lines(tree)), numbers)


def _root() -> Path:
    spec = find_spec("doo3d")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent


def _is_number(value: ast.expr) -> bool:
    """Tell whether an expression is a number, a calculation with numbers alone, or a tuple of such."""
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) and _is_number(value.right)
    if isinstance(value, ast.Tuple | ast.List):
        return bool(value.elts) and all(map(_is_number, value.elts))
    return isinstance(value, ast.Constant) and isinstance(value.value, int | float) and not isinstance(value.value, bool)


def _docstring_lines(tree: ast.AST) -> set[int]:
    lines: set[int] = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for each in body if isinstance(body, list) else []:
            if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant) and isinstance(each.value.value, str):
                lines |= set(range(each.lineno, (each.end_lineno or each.lineno) + 1))
    return lines
