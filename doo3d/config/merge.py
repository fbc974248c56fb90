"""Define the settings of merging, and the weights of each stiffness."""

from typing import Literal

from pydantic import Field

from .section import Section, expert

STIFFNESS = {"thread": 25.0, "rope": 50.0, "cable": 100.0, "rod": 200.0}
"""Stiffness -> weight of direction and of curvature, cost units per radian. "cable" is that of Keipour et al. (RA-L 2022).

docs/pages/accuracy.md has the score of each stiffness.
"""

MAX_GAP_PX = 150.0
"""Default of `merge.max_gap` in 2-D, px of the working picture: chosen on mBEST's photographs, with strands 11 px wide."""


class MergeConfig(Section):
    """Settings of merging, which connects chain ends by their cost (equations 1 to 5 of Keipour et al., RA-L 2022)."""

    chains: int | None = Field(
        None,
        ge=1,
        description="Number of chains to find; in a sequence, of objects. 1 or more; null decides from the data. Set it if you "
        "know it. Tips in plain view are not joined to reach it; a note says if more chains are left.",
    )
    stiffness: Literal["thread", "rope", "cable", "rod"] = Field(
        "cable",
        description="Stiffness of the object: how much a bend adds to the cost of a connection. thread, rope, cable or rod. "
        "Choose the nearest; direction_weight and curvature_weight take precedence where they are set.",
    )
    max_cost: float = Field(
        500.0,
        gt=0,
        description="Do not connect two ends at a higher cost; where `chains` forces further connections, each may cost 3 "
        "times as much. Cost units (1 per mm of gap, or px in 2-D, plus the other weights), over 0; .inf "
        "allows all. Lower it if parts are joined that do not belong together.",
    )
    max_gap: float | None = Field(
        0.25,
        gt=0,
        description="Do not connect two ends that are farther apart; where `chains` forces further connections, three times as "
        "far. m (px in 2-D), over 0; null, in 2-D only, takes 150 px, or as many times more as the photograph is reduced "
        "by (`segment.working_width`). Raise it for wide occluders.",
    )
    min_length: float = Field(
        4.0,
        ge=0,
        description="Remove chains shorter than this, if `chains` is null. Radii, 0 or more. Raise it if clutter is found.",
    )
    allow_closed_chains: bool = Field(
        False,
        description="Allow the two ends of a chain to be connected to each other, which makes a ring, when nothing else "
        "is left to join. true or false. Set it for loops such as belts.",
    )
    branches: bool = Field(
        False,
        description="Look for junctions, where strands of one body meet, and give each object as a tree of chains that run "
        "from junction to junction or to a tip. true or false. Set it for wiring harnesses and hoses with T-pieces.",
    )
    strategy: Literal["greedy", "global"] = expert(
        "global",
        "How connections are chosen. greedy makes the cheapest connection first, as Keipour et al. (RA-L 2022) do; "
        "global makes all connections at the least total cost (maximum-weight matching). Change it only to reproduce "
        "their results.",
    )
    distance_weight: float = expert(
        1.0,
        "Cost of the distance between two ends (w_e of Keipour et al.). Per mm (per px in 2-D), 0 or more. Raise it "
        "if too distant ends are connected.",
        ge=0,
    )
    direction_weight: float | None = expert(
        None,
        "Cost of the angle between the directions of two ends (w_d of Keipour et al.). Per radian, 0 or more; null "
        "takes it from stiffness. Raise it if connections bend too sharply.",
        ge=0,
    )
    curvature_weight: float | None = expert(
        None,
        "Cost of the angle by which an end must bend toward the other end (w_c of Keipour et al.). Per radian, 0 or "
        "more; null takes it from stiffness. Raise it if ends side by side are connected.",
        ge=0,
    )
    free_space_weight: float = expert(
        20.0,
        "Cost of the part of a gap path that runs through free space (space the camera saw through) or over the bare "
        "surface that the object lies on. Per mm (per px in 2-D), 0 or more; 0 turns it off. Lower it if masks or "
        "depth have many holes.",
        ge=0,
    )
    unknown_weight: float = expert(
        2.0,
        "Cost of the part of a gap path that runs through places without depth, or, in a cloud without a camera, of "
        "the whole. Per mm (per px in 2-D), 0 or more. Lower it for sensors with large holes.",
        ge=0,
    )
    exposed_end_cost: float = expert(
        0.0,
        "Cost added for each connected end in plain view (no occluder ahead of it), since it is probably a real tip. "
        "Cost units, 0 or more; 0 turns it off. Raise it for piles of tubes.",
        ge=0,
    )
    gap_side: Literal["outside", "inside"] = expert(
        "outside",
        "Side on which the gap path joins two ends that point away from each other. outside leads it around the gap, "
        "inside through it. Change it for objects that fold back on themselves.",
    )
    tangent_window_radii: float = expert(
        10.0,
        "Length of chain over which the direction of an end is measured. Radii, 0 or more; 0 takes the last segment "
        "alone, as Keipour et al. do. Lower it for objects with tight bends.",
        ge=0,
    )
    custom_costs: dict[str, float] = expert(
        {},
        "Weights of cost terms of your own. Name in doo3d.plugins.CUSTOM_COSTS -> weight, in cost units per unit of the "
        "term. Set it after adding a term there, or installing a plug-in that does.",
    )

    @property
    def gap(self) -> float:
        """The greatest gap in effect, m (px of the working picture in 2-D)."""
        return MAX_GAP_PX if self.max_gap is None else self.max_gap

    @property
    def angle_weights(self) -> tuple[float, float]:
        """The weights of direction and of curvature in effect, cost units per radian: the set values, or those of `stiffness`."""
        own, usual = (self.direction_weight, self.curvature_weight), STIFFNESS[self.stiffness]
        return usual if own[0] is None else own[0], usual if own[1] is None else own[1]
