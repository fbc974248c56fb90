"""Define the configuration: models of its sections, loading from files and overrides, and its documentation."""

from .loading import ConfigLike, as_config, known_keys, load_config, parse_overrides, preset_folder, preset_names
from .merge import MergeConfig
from .models import Config
from .section import Section
from .sections import (
    CrossingsConfig,
    ExtendMaskConfig,
    FitConfig,
    FusionConfig,
    InputConfig,
    PruneConfig,
    RefineConfig,
    SequenceConfig,
    TrackingConfig,
    TraverseConfig,
    VisibilityConfig,
    VoxelizeConfig,
)
from .segment import HsvRange, OnnxConfig, SegmentConfig

__all__ = [
    "Config",
    "ConfigLike",
    "CrossingsConfig",
    "ExtendMaskConfig",
    "FitConfig",
    "FusionConfig",
    "HsvRange",
    "InputConfig",
    "MergeConfig",
    "OnnxConfig",
    "PruneConfig",
    "RefineConfig",
    "Section",
    "SegmentConfig",
    "SequenceConfig",
    "TrackingConfig",
    "TraverseConfig",
    "VisibilityConfig",
    "VoxelizeConfig",
    "as_config",
    "known_keys",
    "load_config",
    "parse_overrides",
    "preset_folder",
    "preset_names",
]
