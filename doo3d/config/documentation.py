"""Document the configuration: as YAML with a comment on each setting, and as a documentation page."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, get_args, get_origin

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from .models import Config
from .section import MAX_NUMBER, MIN_NUMBER, is_expert

COMMENT_COLUMNS = 110
BOUND_SIGNS = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}
TYPE_WORDS = {"float": "number", "int": "whole number", "bool": "true or false", "str": "text", "NoneType": "null"}


class Setting(NamedTuple):
    """One setting of the configuration.

    Attributes
    ----------
    section
        name of the setting's section; None for a setting outside of sections (mode, seed).
    name
        name within the section.
    field
        pydantic's description of the setting: default, type, bounds, help text.
    """

    section: str | None
    name: str
    field: FieldInfo

    @property
    def key(self) -> str:
        """Dotted key of the setting, such as "merge.chains"; only its name outside of sections."""
        return f"{self.section}.{self.name}" if self.section else self.name

    def value_in(self, config: Config) -> Any:
        """Return the value of this setting in a configuration."""
        return getattr(getattr(config, self.section) if self.section else config, self.name)


def all_settings() -> list[Setting]:
    """Return every setting in the order of the documentation: those outside of sections, then section by section."""
    outside, inside = [], []
    for name, field in Config.model_fields.items():
        model = _section_model(field)
        if model is None:
            outside.append(Setting(None, name, field))
        else:
            inside += [Setting(name, inner, item) for inner, item in model.model_fields.items()]
    return outside + inside


def annotated_yaml(config: Config, reasons: Mapping[str, str] | None = None, expert: bool = False) -> str:
    """Return a configuration as commented YAML text, the content of a file for `load_config`.

    The help text of each setting is a comment above it. Settings left out have their defaults, so that `load_config` gives the
    same Config.

    Parameters
    ----------
    config
        the configuration.
    reasons
        dotted key -> reason for the value, a sentence that is added to the comment of that setting.
    expert
        True includes all expert settings; False only those that have a reason or differ from their defaults.
    """
    reasons = reasons or {}
    shown = [
        setting
        for setting in all_settings()
        if expert or not is_expert(setting.field) or setting.key in reasons or setting.value_in(config) != setting.field.default
    ]
    blocks = [_entry(setting, config, reasons) for setting in shown if setting.section is None]
    for section in dict.fromkeys(setting.section for setting in shown if setting.section):
        entries = [_entry(setting, config, reasons) for setting in shown if setting.section == section]
        blocks.append("\n".join([*_comment(_section_summary(section), ""), f"{section}:", *entries]))
    if len(shown) < len(all_settings()):
        blocks.append("# Expert settings with their default values are left out; all: doo3d config --all")
    return "\n\n".join(blocks) + "\n"


def markdown() -> str:
    """Return the documentation page of the configuration as Markdown.

    The page has tables of the basic and the expert settings: default, values, effect.
    """
    parts = [
        "# Configuration",
        "The presets need no settings; begin with `doo3d detect`, and let `doo3d tune` propose settings for a camera and an "
        "object. A preset (`doo3d presets`) or a YAML file of your own sets what differs from the defaults below; "
        "`--set section.setting=value` sets one for one run. `doo3d config` prints the basic settings as YAML, "
        "`doo3d config --all` the expert ones too.",
        "Lengths are metres in 3-D and pixels in 2-D; lengths given in radii or voxels scale with the object. Numbers "
        f"other than 0 are from {MIN_NUMBER:g} to {MAX_NUMBER}, by amount. This page is made from "
        "`doo3d/config/` by `doo3d config --markdown`.",
    ]
    basic = [setting for setting in all_settings() if not is_expert(setting.field)]
    expert = [setting for setting in all_settings() if is_expert(setting.field)]
    parts += ["## Basic settings", "Those that a camera and an object may need.", *_tables(basic, "")]
    parts += [
        "## Expert settings",
        "The weights of Keipour et al. (RA-L 2022), what the presets need, and what unusual sensors need. Everything else is a "
        "named constant in the file of its stage.",
        *_tables(expert, " (expert)"),
    ]
    return "\n\n".join(parts) + "\n"


def _tables(settings: Sequence[Setting], suffix: str) -> list[str]:
    """Return a table of the settings outside of sections, and a heading and a table for every section."""
    parts = []
    for section in dict.fromkeys(setting.section for setting in settings):
        if section is not None:
            parts += [f"### {section}{suffix}", _section_summary(section)]
        rows = [
            (f"`{setting.key}`", f"`{_flow(setting.field.default)}`", _kind(setting.field), setting.field.description or "")
            for setting in settings
            if setting.section == section
        ]
        parts.append(_table(("setting", "default", "values", "effect"), rows))
    return parts


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *(tuple(cell.replace("|", "\\|") for cell in row) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" if line[0] != "---" else f"|{'|'.join(line)}|" for line in lines)


def _section_model(field: FieldInfo) -> type[BaseModel] | None:
    kind = field.annotation
    return kind if isinstance(kind, type) and issubclass(kind, BaseModel) else None


def _section_summary(section: str) -> str:
    model = _section_model(Config.model_fields[section])
    return " ".join(((model and model.__doc__) or "").split())


def _comment(text: str, indent: str) -> list[str]:
    return textwrap.wrap(text, COMMENT_COLUMNS, initial_indent=f"{indent}# ", subsequent_indent=f"{indent}# ")


def _entry(setting: Setting, config: Config, reasons: Mapping[str, str]) -> str:
    """Return the lines of one setting: its description, the reason for its value, and the value."""
    indent = "  " if setting.section else ""
    lines = _comment(setting.field.description or "", indent)
    if setting.key in reasons:
        lines += _comment(f"HERE: {reasons[setting.key]}", indent)
    return "\n".join([*lines, f"{indent}{setting.name}: {_flow(setting.value_in(config))}"])


def _flow(value: Any) -> str:
    """Return a value as YAML on one line."""
    text = str(yaml.safe_dump(_plain(value), default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True))
    return text.removesuffix("\n").removesuffix("\n...")


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _kind(field: FieldInfo) -> str:
    """Return the type and bounds of a setting, such as "number, > 0, <= 2"."""
    bounds = [
        f"{sign} {getattr(bound, name)}" for bound in field.metadata for name, sign in BOUND_SIGNS.items() if hasattr(bound, name)
    ]
    return ", ".join([_type_words(field.annotation), *bounds])


def _type_words(kind: Any) -> str:
    """Return a type annotation in words."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return f"{{{', '.join(kind.model_fields)}}}"
    if hasattr(kind, "__name__") and not get_args(kind):
        return TYPE_WORDS.get(kind.__name__, str(kind.__name__))
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
