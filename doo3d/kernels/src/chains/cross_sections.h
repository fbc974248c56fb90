// Cross-sections at samples along strands.
#pragma once

#include "arrays.h"

// Two unit axes across a strand at each sample, (S, 3): across the line of sight, and away from the sensor.
struct AcrossAxes {
    std::vector<double> lateral, depth;
};

// Without a viewpoint (null) the axes turn as little as they can from sample to sample.
AcrossAxes axes_across(const double* positions, const double* tangents, Index size, const double* viewpoint);

// Return the offsets of a point from a sample along its lateral and its depth axis.
inline std::pair<double, double> offsets_in_section(const double* point, const double* position, const double* lateral, const double* depth) {
    double u = 0.0, w = 0.0;
    for (Index d = 0; d < 3; ++d) {
        const double offset = point[d] - position[d];
        u += offset * lateral[d];
        w += offset * depth[d];
    }
    return {u, w};
}

// The mean of values and their number at each sample: (S,).
struct PooledMeans {
    std::vector<double> mean, count;
};

// Pool the values of points, of which each belongs to a sample, with those of `half` neighbors on either side of it: over all points
// first, then over those that lie no more than `outlier_medians` median residuals from that mean.
PooledMeans means_without_outliers(std::vector<Index> sample, std::vector<double> values, const std::vector<Index>& path, Index half,
                                   double outlier_medians);
