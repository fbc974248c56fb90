// Samples along strands whose axes are measured in a mask, and what is seen of the strands.
#pragma once

#include "cross_sections.h"
#include "plane_rise.h"
#include "silhouette.h"

struct Settings {
    double touching_radii, own_radii, sunk_radii, central_part, smoothing_radii, max_strength, least_weight, ring_overlap;
    double path_weight, depth_weight, gap_weight, radius_tolerance, noise_radii, deviations;
};

// What is seen of the strands; without a camera the mask alone.
struct Seen {
    MaskPixels mask;
    const Matrix<double>& surface;
    const Camera* camera;    // if there is one
    const PlaneView* plane;  // if there is one
};

// S samples along paths, and what does not change from one iteration to the next.
struct Samples {
    Index dim, half;
    std::vector<Index> bounds, owner;
    std::vector<Byte> closed, filled;
    std::vector<double> positions, radius, radii;

    Index size() const { return Index(owner.size()); }
    Index paths() const { return Index(bounds.size()) - 1; }
};

// Axes (S, D) as measured, with their weights (S,) across the line of sight and along it.
struct Measured {
    std::vector<double> target, lateral_weight, depth_weight;
};

// Move axes in the middle of the silhouette back to the depth that the surface points tell.
void add_depth(const Samples& samples, const AcrossAxes& axes, const Seen& seen, const Settings& settings, Measured& measured);
