// What smooth curves along a strand start from: medians and means of the samples around each.
#pragma once

#include "arrays.h"

// Times a curve is smoothed, each time without what the last curve says are outliers.
constexpr Index SMOOTHINGS = 4;

// Return the median of so many values on either side, by a window that is kept sorted; beyond both ends the values go on straight.
std::vector<double> running_median(const std::vector<double>& values, Index half);

// Return the means of so many values on either side, by a running sum; beyond both ends the last value goes on.
std::vector<double> running_mean(const std::vector<double>& values, Index half);
