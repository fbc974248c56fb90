// Which readings along a strand are the strand's, where most of them may be of what lies behind it.
#pragma once

#include "arrays.h"

// Radii behind the strand from which on a reading is of something else.
constexpr double TORN_RADII = 2.5;

// A strand's readings and its radius in the image.
struct Strand {
    std::vector<double> filled;   // 1/m, inverse depth, interpolated where it was not measured
    std::vector<double> surface;  // 1/m, inverse depth of what is seen beside it; infinite where that is not known
    std::vector<Byte> measured;
    double radius_px;
};

// Return the samples whose flags are set.
std::vector<Index> samples_of(const std::vector<Byte>& flags);

// Return the values of some samples.
std::vector<double> chosen(const std::vector<double>& values, const std::vector<Index>& samples);

// Return the samples that are the strand: with readings, of the chain of runs that costs least.
//
// known : samples with readings. per_radius : inverse depth of a radius along the line of sight. max_slope : m along the line of sight per m
// across it, from which on a step between two readings is a jump.
std::vector<Index> strand_samples(const Strand& strand, const std::vector<Index>& known, double per_radius, double max_slope);
