"""The configuration: presets, files, overrides, and what is said when a value cannot be."""

from __future__ import annotations

import math

import pytest
import yaml
from pydantic import ValidationError

from doo3d.config import Config, known_keys, load_config, parse_overrides, preset_names
from doo3d.errors import ConfigError


@pytest.mark.parametrize("name", preset_names())
def test_presets_load_and_read_back(name, tmp_path):
    config = load_config(name)
    path = tmp_path / "again.yaml"
    path.write_text(config.to_yaml(), encoding="utf-8")
    assert load_config(path) == config
    assert load_config(str(path)) == config


def test_the_default_preset_is_the_default():
    assert load_config() == load_config("default") == Config()


def test_paper_preset_has_the_papers_weights():
    merge = load_config("paper_3d").merge
    assert (merge.distance_weight, merge.direction_weight, merge.curvature_weight) == (1, 100, 100)
    assert merge.max_cost == math.inf


def test_overrides():
    config = load_config("default", {"fit.segment_length": 0.02, "merge.chains": None, "seed": 3})
    assert (config.fit.segment_length, config.merge.chains, config.seed) == (0.02, None, 3)
    assert config.thin == Config().thin


def test_overrides_as_text():
    pairs = ["merge.chains=null", "fit.segment_length=5e-3", "segment.ranges=[{low: [170, 1, 2], high: [9, 255, 255]}]"]
    config = load_config("default", parse_overrides(pairs))
    assert config.merge.chains is None
    assert config.fit.segment_length == 0.005
    assert config.segment.ranges[0].low == (170, 1, 2)


@pytest.mark.parametrize("pair", ["merge.chains", "=2", " = 2", "merge.chains=[", "merge.chains={a"])
def test_overrides_that_are_none(pair):
    with pytest.raises(ConfigError, match=r"--set"):
        parse_overrides([pair])


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("merge.chain", 2, "unknown key merge.chain, did you mean merge.chains"),
        ("fit.segment_lenght", 0.01, "did you mean fit.segment_length"),
        ("mrege.chains", 2, "did you mean merge"),
        ("segment_length", 0.01, "did you mean fit.segment_length"),
        ("zzz", 1, "unknown key zzz; the sections are mode, seed, segment"),
        ("merge.chains", 0, "merge.chains.*greater than or equal to 1, got 0"),
        ("fit.segment_length", -0.01, "fit.segment_length.*greater than 0, got -0.01"),
        ("fit.segment_length", "long", "fit.segment_length.*'long'"),
        ("voxelize.close", 1.5, "voxelize.close.*1.5"),
        ("segment.method", "magic", "segment.method.*'magic'"),
        ("segment.method", "hsv", "segment.ranges is empty"),
        ("segment.method", "background", "segment.reference is not set"),
        ("segment.ranges", [{"low": [200, 0, 0], "high": [10, 255, 255]}], "hue is 200"),
        ("segment.ranges", [{"low": [0, 9, 0], "high": [10, 5, 255]}], "saturation 9 is above"),
        ("segment.min_depth", 30.0, "min_depth 30.0 is not below"),
        ("seed.x", 1, "seed is not a section|seed"),
        ("seed", -1, "seed"),
    ],
)
def test_values_that_cannot_be(key, value, words):
    with pytest.raises(ConfigError, match=words):
        load_config("default", {key: value})


def test_no_such_preset():
    with pytest.raises(ConfigError, match=r"no preset 'defalt'.*default.*\.yaml"):
        load_config("defalt")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("merge: [", "not valid YAML"),
        ("[1, 2]", "expected sections"),
        ("hello", "expected sections"),
        ("merge: 3", "merge"),
        ("merge:\n  chian: 1", "did you mean merge.chains"),
        ("a: &a [*a]", ""),
        ("!!python/object:os.system {}", "not valid YAML"),
    ],
)
def test_files_that_cannot_be(text, words, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=rf"mine\.yaml.*{words}"):
        load_config(path)


def test_a_file_that_is_not_there_or_not_text(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere\.yaml"):
        load_config(tmp_path / "nowhere.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ConfigError, match=r"binary\.yaml"):
        load_config(tmp_path / "binary.yaml")


def test_an_empty_file_is_the_default(tmp_path):
    (tmp_path / "empty.yaml").write_text("")
    assert load_config(tmp_path / "empty.yaml") == Config()


def test_it_is_frozen():
    with pytest.raises(ValidationError):
        Config().seed = 2


def test_known_keys_are_all_and_no_more():
    keys = known_keys()
    assert "merge.chains" in keys
    assert "seed" in keys
    assert len(keys) == len(set(keys))
    values = yaml.safe_load(Config().to_yaml())
    assert set(keys) == set(values) | {f"{a}.{b}" for a, inner in values.items() if isinstance(inner, dict) for b in inner}


def test_every_field_says_what_it_is():
    for name, field in Config.model_fields.items():
        inner = getattr(field.annotation, "model_fields", {name: field})
        for key, item in inner.items():
            assert item.description, f"{name}.{key}"
