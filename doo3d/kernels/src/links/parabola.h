// Robust least-squares parabolas.
#pragma once

#include "arrays.h"

// Return the value at 0 of the least-squares parabola through values along a strand, without those that differ by more than some median
// residuals, twice; NaN where fewer than `min_measured` values are left, or none on one side of 0. Values that are NaN are not measured.
double parabola_at_zero(const double* along, const std::vector<double>& values, double deviations, Index min_measured);
