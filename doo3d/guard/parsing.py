"""Parse untrusted JSON and YAML to plain values, with bounds on size, nesting depth and magnitude."""

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.resolver import Resolver
from yaml.scanner import Scanner

from ..errors import DooError, InputError
from .guarding import first_line, read_bytes

MAX_JSON_BYTES = 1 << 26
"""Greatest size of a JSON file in bytes: the metadata of an hour's recording has 40 MB; parsed, it takes up to 30 times as
much."""

MAX_JSON_VALUES = 3_500_000
"""Greatest number of values of a JSON text, by commas and brackets: an hour of poses has 3 million, which take 500 MB."""

MAX_YAML_BYTES = 1 << 20
"""Greatest size of a YAML text in bytes: the description of a bag of 4000 files."""

MAX_YAML_VALUES = 100_000
"""Greatest number of values of a YAML text: the description of a bag of 4000 files has 80,000, which take two seconds."""

MAX_DEPTH = 60
"""Greatest nesting depth of lists and objects; valid files have at most 10."""

_MAX_BITS = 1000  # of a whole number: larger ones are no floats
_MAX_NUMBER_LETTERS = 400  # of a number in YAML, before it is converted
_FREE_ALIASES = 10_000  # values that aliases may repeat in a YAML text, besides ten times those written out
_NUMBER_TAGS = {f"tag:yaml.org,2002:{name}" for name in ("int", "float", "timestamp")}


def read_json(path: str | Path) -> Any:
    """Read the value of a JSON file; raise InputError if it cannot be read, is not JSON, or exceeds the bounds."""
    return parse_json(read_bytes(path, MAX_JSON_BYTES), str(path))


def read_yaml(path: str | Path, where: str | None = None, kind: type[DooError] = InputError) -> Any:
    """Read the value of a YAML file.

    Parameters
    ----------
    path
        the file.
    where
        name of the file in errors; None for its path.
    kind
        type of the errors.

    Raises
    ------
    DooError : of type `kind`: the file cannot be read, is not YAML, or exceeds the bounds.
    """
    return parse_yaml(read_bytes(path, MAX_YAML_BYTES, where, kind), str(path) if where is None else where, kind)


def parse_json(text: str | bytes, where: str) -> Any:
    """Return the value of a JSON text; bytes are UTF-8. where : the file, named in errors.

    Raises
    ------
    InputError : with the code "json-invalid": the text is not JSON, is nested too deeply, or holds a whole number beyond the
        largest float.
    """
    try:
        text = text.decode("utf-8-sig") if isinstance(text, bytes) else text
        if sum(map(text.count, ",[{")) > MAX_JSON_VALUES:
            raise ValueError(f"more than {MAX_JSON_VALUES} values")
        value = json.loads(text)
        _check_values(value)
    except (ValueError, RecursionError, MemoryError) as error:
        raise InputError(f"{where}: is not valid JSON ({first_line(error)})", code="json-invalid") from None
    return value


def parse_yaml(text: str | bytes, where: str, kind: type[DooError] = InputError, *, ignore_tags: bool = False) -> Any:
    """Return the value of a YAML text; only plain values are allowed, no Python objects.

    Parameters
    ----------
    text
        the text; bytes are UTF-8.
    where
        the file or the option, named in errors.
    kind
        type of the errors.
    ignore_tags
        True ignores the tags of unknown types, such as OpenCV's `!!opencv-matrix`; reads the first non-empty document of several;
        and skips OpenCV's first line %YAML:1.0, which is not valid YAML.

    Raises
    ------
    DooError : of type `kind`, with the code "yaml-invalid": the text is not YAML, is nested too deeply, expands too much by
        aliases, or holds a whole number beyond the largest float.
    """
    try:
        text = text.decode("utf-8-sig") if isinstance(text, bytes) else text
        if len(text) > MAX_YAML_BYTES:
            raise ValueError(f"more than {MAX_YAML_BYTES} letters")
        text = re.sub(r"\A\s*%YAML[^\n]*\n", "", text) if ignore_tags else text
        loader = (_UntaggedLoader if ignore_tags else _Loader)(text)
        try:
            value = loader.first() if ignore_tags else loader.get_single_data()
        finally:
            loader.dispose()
        _check_values(value)
    except Exception as error:  # PyYAML raises much besides its own errors, such as AttributeError for a damaged date
        reason = " ".join(str(error).split()) or type(error).__name__
        raise kind(f"{where}: is not valid YAML ({reason})", code="yaml-invalid") from None
    return value


class _PythonParser(Reader, Scanner, Parser):
    """PyYAML's parser in pure Python, ten times slower than libyaml."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)


if TYPE_CHECKING or not yaml.__with_libyaml__:
    _Parser = _PythonParser
else:
    from yaml.cyaml import CParser as _Parser


class _Loader(Composer, _Parser, SafeConstructor, Resolver):
    """PyYAML's loader of plain values, with bounds that are checked on nodes, before values are made."""

    def __init__(self, text: str) -> None:
        _Parser.__init__(self, text)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)
        self._depth = self._count = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node; raise an error if it is nested too deeply or there are too many nodes."""
        self._depth += 1
        self._count += 1
        if self._count > MAX_YAML_VALUES:
            raise ValueError(f"more than {MAX_YAML_VALUES} values")
        if self._depth > MAX_DEPTH:
            raise ValueError(f"nested more than {MAX_DEPTH} deep")
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def first(self) -> Any:
        """Return the first document that is not empty; None if there is none."""
        value = None
        while value is None and super().check_data():  # type: ignore[no-untyped-call]
            value = self.get_data()
        return value

    def compose_document(self) -> Any:
        """Compose a document; raise an error if its numbers are too long or its aliases expand too much."""
        node = super().compose_document()
        sizes: dict[int, int] = {}
        if node is not None and _repeated(node, sizes) > 10 * len(sizes) + _FREE_ALIASES:
            raise ValueError("aliases repeat its values out of proportion")
        return node


class _UntaggedLoader(_Loader):
    """A loader that ignores unknown tags."""


def _untagged(loader: _UntaggedLoader, suffix: str, node: yaml.Node) -> Any:
    if isinstance(node, yaml.MappingNode):
        return loader.construct_mapping(node, deep=True)
    if isinstance(node, yaml.SequenceNode):
        return loader.construct_sequence(node, deep=True)
    return loader.construct_scalar(node) if isinstance(node, yaml.ScalarNode) else None


_UntaggedLoader.add_multi_constructor("", _untagged)


def _repeated(node: yaml.Node, sizes: dict[int, int]) -> int:
    """Return the number of nodes in a tree, counting those repeated by aliases; `sizes` caches it by node."""
    if id(node) in sizes:
        if not sizes[id(node)]:
            raise ValueError("a value contains itself")
        return sizes[id(node)]
    sizes[id(node)] = 0
    inner: list[Any] = []
    if isinstance(node, yaml.MappingNode):
        inner = [part for pair in node.value for part in pair]
    elif isinstance(node, yaml.SequenceNode):
        inner = node.value
    elif node.tag in _NUMBER_TAGS and len(node.value) > _MAX_NUMBER_LETTERS:
        raise ValueError(f"a number of {len(node.value)} letters")
    sizes[id(node)] = 1 + sum(_repeated(part, sizes) for part in inner)
    return sizes[id(node)]


def is_plain(value: Any) -> bool:
    """Return whether a parsed value is within the bounds of `parse_json`: nesting depth, and whole numbers up to floats."""
    try:
        _check_values(value)
    except ValueError:
        return False
    return True


def _check_values(value: Any) -> None:
    """Raise ValueError if lists and objects are nested too deeply, or a whole number exceeds the largest float."""
    level, depth = [value], 0
    while level:
        depth += 1
        if depth > MAX_DEPTH:
            raise ValueError(f"nested more than {MAX_DEPTH} deep")
        deeper: list[Any] = []
        for item in level:
            if type(item) is float:  # as most are
                continue
            if isinstance(item, dict):
                deeper.extend(item.values())
                deeper.extend(item)
            elif isinstance(item, list | set | tuple):
                deeper.extend(item)
            elif isinstance(item, int) and item.bit_length() > _MAX_BITS:
                raise ValueError("a whole number beyond the largest float")
        level = deeper
