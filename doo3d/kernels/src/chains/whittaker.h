// Whittaker's smoother of a sequence of points.
#pragma once

#include "arrays.h"

// Return the smooth points (count, dim): those that weights (count, dim, dim) hold near the values and whose differences of an order
// are small. The values themselves if there are no more than `order`, or strength is 0.
std::vector<double> whittaker(const double* values, const double* weights, Index count, Index dim, double strength, Index order);
