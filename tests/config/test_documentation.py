"""The configuration for people: it reads back, explains every setting, and the page in docs/ is up to date."""

import pytest
import yaml
from builders.paths import ROOT

from doo3d.config import Config, known_keys, load_config, preset_names
from doo3d.config.documentation import all_settings, annotated_yaml, markdown
from doo3d.config.section import is_expert

PAGE = ROOT / "docs" / "pages" / "configuration.md"
RANGES = [{"low": [170, 80, 40], "high": [10, 255, 255]}]


@pytest.mark.parametrize("expert", [False, True])
@pytest.mark.parametrize("name", preset_names())
def test_annotated_yaml_reads_back_to_the_same_config(name, expert, tmp_path):
    config = load_config(name, {"segment.ranges": RANGES, "segment.method": "hsv", "segment.reference": "é: #x"})
    text = annotated_yaml(config, expert=expert)
    assert Config.model_validate(yaml.safe_load(text)) == config
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    assert load_config(tmp_path / "mine.yaml") == config


def test_basic_settings_are_shown_and_of_the_expert_ones_those_that_are_set():
    settings = {setting.key: setting for setting in all_settings()}
    assert {".".join(key.split(".")[:2]) for key in known_keys() if "." in key} <= settings.keys()
    basic = {key for key, setting in settings.items() if not is_expert(setting.field)}
    assert 15 <= len(basic) <= 25
    assert keys_in(annotated_yaml(Config())) == basic
    assert keys_in(annotated_yaml(Config(), expert=True)) == settings.keys()
    weight = load_config("default", {"merge.distance_weight": 2})
    assert keys_in(annotated_yaml(weight)) == basic | {"merge.distance_weight"}
    assert keys_in(annotated_yaml(Config(), {"voxelize.size": "because"})) == basic | {"voxelize.size"}
    assert "# HERE: because\n  size: null" in annotated_yaml(Config(), {"voxelize.size": "because"})


def keys_in(text: str) -> set[str]:
    sections = {key: value for key, value in yaml.safe_load(text).items() if isinstance(value, dict)}
    return {f"{name}.{key}" for name, inner in sections.items() for key in inner} | yaml.safe_load(text).keys() - sections.keys()


def test_every_setting_is_on_the_page_in_its_tier():
    basic, _, expert = markdown().partition("## Expert settings")
    for setting in all_settings():
        assert f"| `{setting.key}` |" in (expert if is_expert(setting.field) else basic)
        assert setting.field.description
    assert "number, >= 0" in expert


def test_the_page_in_docs_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == markdown(), "run: doo3d config --markdown > docs/pages/configuration.md"
