"""Makes the stub of the kernels from their built module: its signatures as nanobind knows them, and its docstrings.

    cmake --build build --target stub                         # build, and write doo3d/kernels/__init__.pyi
    python doo3d/kernels/backend/stub.py build/_native.so     # of a module that is built

Arguments are arrays of a kind of numbers, such as `Floats`, whose data type the docstring tells; results are arrays of a data
type, such as `NDArray[np.float64]`. nanobind makes the first form of the stub, ruff its layout.
"""

import ast
import subprocess
import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from nanobind.stubgen import StubGen

STUB = Path(__file__).resolve().parents[1] / "__init__.pyi"
NAME = "doo3d.kernels._native"
KINDS = {"bool_": "Bools", "float32": "Floats", "float64": "Floats", "int32": "Ints", "int64": "Ints", "uint8": "Array"}
HEAD = '''# Made by backend/stub.py from the comments and signatures in src/: change those, and make it anew (CONTRIBUTING.md).
"""{doc}
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..types import {kinds}

'''


class _Arrays(ast.NodeTransformer):
    """Shortens the types of arrays, and lays out docstrings."""

    def __init__(self) -> None:
        self.in_arguments, self.depth = False, 0

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        if ast.unparse(node.value) != "Annotated":
            return self.generic_visit(node)
        array = node.slice.elts[0].slice.attr
        return ast.Name(KINDS[array] if self.in_arguments else f"NDArray[np.{array}]")

    def visit_arguments(self, node: ast.arguments) -> ast.AST:
        self.in_arguments = True
        self.generic_visit(node)
        self.in_arguments = False
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.ClassDef) -> ast.AST:
        self.depth += 1
        self.generic_visit(node)
        if text := ast.get_docstring(node):
            lines = text.splitlines() + [""] * ("\n" in text)
            node.body[0].value.value = ("\n" + "    " * self.depth).join(lines)
        self.depth -= 1
        return node

    visit_ClassDef = visit_FunctionDef


def stub_of(native: ModuleType) -> str:
    """Return the text of the stub that declares the functions and classes of the built module, in alphabetic order."""
    made = StubGen(module=native)
    made.put(native)
    parts = [node for node in ast.parse(made.get()).body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    body = "\n".join(ast.unparse(_Arrays().visit(node)) for node in sorted(parts, key=lambda node: node.name))
    kinds = ", ".join(sorted(set(KINDS.values())))
    command = [sys.executable, "-m", "ruff", "format", "--quiet", "--stdin-filename", STUB, "-"]
    text = HEAD.format(doc=native.__doc__, kinds=kinds) + body
    return subprocess.run(command, input=text, check=True, capture_output=True, encoding="utf-8").stdout


def load(path: str) -> ModuleType:
    """Return the built module in a file, without the package, which refuses a module that its stub does not fit."""
    spec = spec_from_file_location(NAME, path, loader=ExtensionFileLoader(NAME, path))
    native = module_from_spec(spec)
    spec.loader.exec_module(native)
    return native


if __name__ == "__main__":
    STUB.write_text(stub_of(load(sys.argv[1])), encoding="utf-8", newline="\n")
