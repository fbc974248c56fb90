"""The configuration: presets, files, overrides, and the errors of what cannot be used."""

import math

import pytest
import yaml
from builders.errors import refuses
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
    assert config.traverse == Config().traverse


def test_overrides_as_text():
    pairs = ["merge.chains=null", "fit.segment_length=5e-3", "segment.ranges=[{low: [170, 1, 2], high: [9, 255, 255]}]"]
    config = load_config("default", parse_overrides(pairs))
    assert config.merge.chains is None
    assert config.fit.segment_length == 0.005
    assert config.segment.ranges[0].low == (170, 1, 2)


@pytest.mark.parametrize(
    ("pair", "code"),
    [
        ("merge.chains", "override-invalid"),
        ("=2", "override-invalid"),
        (" = 2", "override-invalid"),
        ("merge.chains=[", "yaml-invalid"),
        ("merge.chains={a", "yaml-invalid"),
    ],
)
def test_overrides_that_are_none(pair, code):
    with refuses(code, "--set", kind=ConfigError):
        parse_overrides([pair])


@pytest.mark.parametrize(
    ("key", "value", "code", "parts"),
    [
        ("merge.chain", 2, "key-unknown", ("merge.chain", "merge.chains")),
        ("fit.segment_lenght", 0.01, "key-unknown", ("fit.segment_lenght", "fit.segment_length")),
        ("mrege.chains", 2, "key-unknown", ("mrege", "merge")),
        ("segment_length", 0.01, "key-unknown", ("fit.segment_length",)),
        ("merge.curvature_persistence", 0.7, "key-unknown", ("merge.curvature_persistence", "straight on")),
        ("zzz", 1, "key-unknown", ("zzz", "mode, seed, segment")),
        ("merge.chains", 0, "value-out-of-bounds", ("merge.chains", "got 0")),
        ("fit.segment_length", -0.01, "value-out-of-bounds", ("fit.segment_length", "got -0.01")),
        ("fit.segment_length", "long", "value-invalid", ("fit.segment_length", "'long'")),
        ("refine.iterations", 1.5, "value-invalid", ("refine.iterations", "1.5")),
        ("segment.method", "magic", "value-invalid", ("segment.method", "'magic'")),
        ("segment.method", "hsv", "value-invalid", ("segment.ranges",)),
        ("segment.method", "background", "value-invalid", ("segment.reference",)),
        ("segment.ranges", [{"low": [200, 0, 0], "high": [10, 255, 255]}], "value-invalid", ("hue", "200")),
        ("segment.ranges", [{"low": [0, 9, 0], "high": [10, 5, 255]}], "value-invalid", ("saturation 9",)),
        ("segment.min_depth", 30.0, "value-invalid", ("segment.min_depth 30.0",)),
        ("seed.x", 1, "value-invalid", ("seed",)),
        ("seed", -1, "value-out-of-bounds", ("seed",)),
    ],
)
def test_values_that_cannot_be(key, value, code, parts):
    with refuses(code, *parts, kind=ConfigError):
        load_config("default", {key: value})


def test_a_key_below_what_is_no_section(tmp_path):
    (tmp_path / "mine.yaml").write_text("merge: 3")
    with refuses("section-expected", "merge.chains", kind=ConfigError):
        load_config(tmp_path / "mine.yaml", {"merge.chains": 2})


def test_no_such_preset():
    with refuses("preset-unknown", "defalt", "default", ".yaml", kind=ConfigError):
        load_config("defalt")


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("merge: [", "yaml-invalid"),
        ("[1, 2]", "section-expected"),
        ("hello", "section-expected"),
        ("merge: 3", "value-invalid"),
        ("merge:\n  chian: 1", "key-unknown"),
        ("a: &a [*a]", "yaml-invalid"),
        ("!!python/object:os.system {}", "yaml-invalid"),
    ],
)
def test_files_that_cannot_be(text, code, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with refuses(code, "mine.yaml", kind=ConfigError):
        load_config(path)


def test_a_file_that_is_not_there_or_not_text(tmp_path):
    with refuses("file-missing", "nowhere.yaml", kind=ConfigError):
        load_config(tmp_path / "nowhere.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with refuses("yaml-invalid", "binary.yaml", kind=ConfigError):
        load_config(tmp_path / "binary.yaml")


def test_an_empty_file_is_the_default(tmp_path):
    (tmp_path / "empty.yaml").write_text("")
    assert load_config(tmp_path / "empty.yaml") == Config()


def test_it_is_frozen():
    with pytest.raises(ValidationError):
        Config().seed = 2


def dotted(values, prefix=""):
    """Return the keys of a configuration, each section's own before those in it."""
    inner = [dotted(value, f"{prefix}{key}.") for key, value in values.items() if isinstance(value, dict)]
    return [*(prefix + key for key in values), *(key for keys in inner for key in keys)]


def test_known_keys_are_all_and_no_more():
    keys = known_keys()
    assert "merge.chains" in keys
    assert "seed" in keys
    assert len(keys) == len(set(keys))
    values = yaml.safe_load(Config().to_yaml())
    assert set(keys) == set(dotted(values))


def test_every_field_says_what_it_is():
    for name, field in Config.model_fields.items():
        inner = getattr(field.annotation, "model_fields", {name: field})
        for key, item in inner.items():
            assert item.description, f"{name}.{key}"


@pytest.mark.parametrize("value", [5e-324, 1e-8, 1e300, 2**64, 10**400, float("inf"), float("nan")])
@pytest.mark.parametrize("key", ["voxelize.radius", "merge.min_length", "fit.segment_length", "merge.chains", "seed"])
def test_numbers_beyond_any_camera_or_object_are_refused(key, value):
    with pytest.raises(ConfigError) as caught:
        load_config("default", {key: value})
    assert key in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_no_limit_is_infinite_where_presets_say_so():
    assert load_config("default", {"merge.max_gap": float("inf")}).merge.max_gap == float("inf")
    with pytest.raises(ConfigError, match="custom_costs"):
        load_config("default", {"merge.custom_costs": {"a": 1e300}})
