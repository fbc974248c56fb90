"""The configuration for people: as YAML with a comment to each field, and as a page of the documentation."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any, get_args, get_origin

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from .models import Config

_WIDTH = 110  # columns of the comments
_SIGNS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}
_WORDS = {"float": "number", "int": "whole number", "bool": "true or false", "str": "text", "NoneType": "null"}


def annotated_yaml(config: Config, reasons: Mapping[str, str] | None = None) -> str:
    """The effective configuration as YAML that `load_config` reads back, with each field's description above it.

    reasons : dotted key -> why the field is as it is, below its description.
    """
    blocks, why = [], reasons or {}
    for name, field in Config.model_fields.items():
        value = getattr(config, name)
        if isinstance(value, BaseModel):
            head = _comment(_summary(type(value)), "")
            fields = [
                _entry(key, item, getattr(value, key), "  ", why.get(f"{name}.{key}"))
                for key, item in type(value).model_fields.items()
            ]
            blocks.append("\n".join([*head, f"{name}:", *fields]))
        else:
            blocks.append(_entry(name, field, value, "", why.get(name)))
    return "\n\n".join(blocks) + "\n"


def markdown() -> str:
    """The page that lists every field with its default, what it may be, and what it does."""
    parts = [
        "# Configuration",
        "Made from the models in `doo3d/config.py` by `doo3d config --markdown`. A preset (`doo3d presets`) or a YAML file of "
        "your own sets what differs from these defaults; `--set section.field=value` sets one field for one run. Lengths "
        "are metres in 3-D and pixels in 2-D; lengths given in radii or voxels go with the object.",
        _table([item for item in Config.model_fields.items() if _section(item[1]) is None], ""),
    ]
    for name, field in Config.model_fields.items():
        kind = _section(field)
        if kind is not None:
            parts += [f"## {name}", _summary(kind), _table(list(kind.model_fields.items()), f"{name}.")]
    return "\n\n".join(parts) + "\n"


def _section(field: FieldInfo) -> type[BaseModel] | None:
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _summary(model: type[BaseModel]) -> str:
    return " ".join((model.__doc__ or "").split())


def _comment(text: str, indent: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")


def _entry(key: str, field: FieldInfo, value: Any, indent: str, reason: str | None = None) -> str:
    bounds = _bounds(field)
    lines = _comment(f"{field.description or ''}{f' [{bounds}]' if bounds else ''}", indent)
    lines += _comment(f"HERE: {reason}", indent) if reason else []
    return "\n".join([*lines, f"{indent}{key}: {_flow(value)}"])


def _flow(value: Any) -> str:
    """The value as YAML on one line."""
    text = str(yaml.safe_dump(_plain(value), default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True))
    return text.removesuffix("\n").removesuffix("\n...")


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _table(fields: list[tuple[str, FieldInfo]], prefix: str) -> str:
    rows = ["| field | default | may be | what it does |", "|---|---|---|---|"]
    for key, field in fields:
        cells = (f"`{prefix}{key}`", f"`{_flow(field.default)}`", _kind(field), field.description or "")
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def _kind(field: FieldInfo) -> str:
    bounds = _bounds(field)
    return _type_words(field.annotation) + (f", {bounds}" if bounds else "")


def _bounds(field: FieldInfo) -> str:
    """Such as "> 0, <= 2"; empty where there are none."""
    parts = []
    for bound in field.metadata:
        parts += [f"{sign} {getattr(bound, name)}" for name, sign in _SIGNS.items() if hasattr(bound, name)]
    return ", ".join(parts)


def _type_words(kind: Any) -> str:
    if hasattr(kind, "__name__") and not get_args(kind):
        return _WORDS.get(kind.__name__, str(kind.__name__))
    if get_origin(kind) is dict:
        return f"names, each with a {_type_words(get_args(kind)[1])}"
    if get_origin(kind) is tuple:
        item = get_args(kind)[0]
        is_model = isinstance(item, type) and issubclass(item, BaseModel)
        return f"list of {{{', '.join(item.model_fields)}}}" if is_model else "list"
    choices = get_args(kind)
    if all(isinstance(choice, str) for choice in choices):
        return ", ".join(f"`{choice}`" for choice in choices)
    return " or ".join(_type_words(choice) for choice in choices)
