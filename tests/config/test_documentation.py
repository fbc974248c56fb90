"""The configuration for people: it reads back, says everything, and the page in docs/ is the current one."""

from __future__ import annotations

import pytest
import yaml
from builders.paths import ROOT

from doo3d.config import Config, known_keys, load_config, preset_names
from doo3d.config.documentation import annotated_yaml, markdown

PAGE = ROOT / "docs" / "configuration.md"
RANGES = [{"low": [170, 80, 40], "high": [10, 255, 255]}]


@pytest.mark.parametrize("name", preset_names())
def test_annotated_yaml_reads_back_to_the_same_config(name, tmp_path):
    config = load_config(name, {"segment.ranges": RANGES, "segment.method": "hsv", "segment.reference": "é: #x"})
    text = annotated_yaml(config)
    assert Config.model_validate(yaml.safe_load(text)) == config
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    assert load_config(tmp_path / "mine.yaml") == config


def test_every_field_is_explained():
    text, page = annotated_yaml(Config()), markdown()
    for key in known_keys():
        section, _, field = key.partition(".")
        assert f"{field or section}:" in text
        assert f"`{key}`" in page or f"## {key}" in page
    assert ">= 0" in text


def test_the_page_in_docs_is_current():
    assert PAGE.read_text(encoding="utf-8") == markdown(), "run: doo3d config --markdown > docs/configuration.md"
