// The depth readings of a mask: their median and noise, and the readings that agree with their neighbors.
#pragma once

#include "frame_facts.h"

// Number of readings, their median and the median step between horizontal neighbors, m; the medians are 0 without any.
struct DepthSummary {
    Index readings = 0;
    float median = 0, noise = 0;
};

// Readings in row-major order, with the mean of each and of its neighbors that agree, and the number of those without enough.
struct AgreeingReadings {
    std::vector<Index> pixels;  // u and v in turn
    std::vector<double> depth, means;
    Index dropped = 0;
};

// depth : the depth (height, width) of the frame, m, 0 = no reading.
DepthSummary summarize_depth(const FrameFacts& facts, const float* depth);

// Return the standard deviation of the inverse of the readings, 1/m, with that of rounding; 0 if no two neighbors in a row differ. It
// is estimated from the pixels of some runs, evenly drawn: up to twice as many as `pixels`.
double inverse_depth_noise(const FrameFacts& facts, const float* depth, Index pixels);

// Return the pixels of the mask without a reading in the holes of its depth, u and v in turn: those farther than `reach` px, in rows or
// columns, from every kept reading, and those as near to one of these.
//
// kept : `count` pixels (u, v) whose readings were kept.
std::vector<Index> depth_holes(const FrameFacts& facts, const float* depth, const Index* kept, Index count, Index reach);

// Which readings agree. Those that lie farther beyond the median than the nearest lies before it may differ in proportion to their
// distance.
struct Agreement {
    float low, high;   // m, the range of readings
    Index half_width;  // px, of the window
    double slope;      // m per px of distance by which readings agree
    float median;      // m, of the readings
    Index min_agreeing;
};
AgreeingReadings agreeing_readings(const FrameFacts& facts, const float* depth, Agreement rule);
