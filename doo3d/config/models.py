"""Define the configuration: one frozen model per stage, with settings in two tiers.

Basic settings are those a user sets for a camera and an object. Expert settings are the weights of Keipour et al. (RA-L
2022), what presets need, and what unusual sensors need. Everything else is a named constant, with its unit and reason, in the
file of its stage.

Lengths are metres in 3-D and pixels in 2-D; lengths that depend on the object are given in its radii or in voxels, so that they
hold for a thread as for a hose.
"""

from __future__ import annotations

from typing import Any, Literal

import yaml
from pydantic import Field, ValidationError, model_validator

from . import sections
from .merge import MergeConfig
from .refusals import config_error
from .section import Section, expert
from .segment import SegmentConfig


class Config(Section):
    """The whole configuration: a section per stage, and sections for what stages share.

    All fields have defaults; a Config without arguments is the preset "default". It cannot be changed after creation.
    """

    def __init__(self, **settings: Any) -> None:
        try:
            super().__init__(**settings)
        except ValidationError as error:
            raise config_error(error, type(self), "Config") from None

    mode: Literal["auto", "2d"] = Field(
        "auto",
        description="Whether to work in space or in the image. auto works in 3-D; 2d in the image, without depth and with "
        "lengths in pixels. Choose a preset rather than set it: image and paper_2d set 2d.",
    )
    seed: int = expert(
        0,
        "Seed of all random numbers. Whole number, 0 or more. Change it only to see how much results depend on chance.",
        ge=0,
    )
    segment: SegmentConfig = SegmentConfig()
    voxelize: sections.VoxelizeConfig = sections.VoxelizeConfig()
    traverse: sections.TraverseConfig = sections.TraverseConfig()
    fit: sections.FitConfig = sections.FitConfig()
    prune: sections.PruneConfig = sections.PruneConfig()
    merge: MergeConfig = MergeConfig()
    refine: sections.RefineConfig = sections.RefineConfig()
    crossings: sections.CrossingsConfig = sections.CrossingsConfig()
    extend_mask: sections.ExtendMaskConfig = sections.ExtendMaskConfig()
    visibility: sections.VisibilityConfig = sections.VisibilityConfig()
    tracking: sections.TrackingConfig = sections.TrackingConfig()
    sequence: sections.SequenceConfig = sections.SequenceConfig()
    fusion: sections.FusionConfig = sections.FusionConfig()
    input: sections.InputConfig = sections.InputConfig()
    output: sections.OutputConfig = sections.OutputConfig()

    @model_validator(mode="after")
    def _lengths_are_set(self) -> Config:
        for key, value in (("fit.segment_length", self.fit.segment_length), ("merge.max_gap", self.merge.max_gap)):
            if value is None and self.mode != "2d":
                raise ValueError(f"{key} is null, which only a 2-D config may have (mode: 2d): give metres")
        return self

    def to_yaml(self) -> str:
        """Return all settings with their values as YAML text without comments; `load_config` reads it back to an equal Config."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)
