// A part of the True pixels of a mask, evenly distributed.
#pragma once

#include "runs.h"

struct LatticePixels {
    std::vector<double> pixels;  // u and v of each, sorted by u and then v
    Index count = 0;             // of all pixels of the mask
};

LatticePixels lattice_of(const std::vector<Run>& runs, Index width, Index most, double golden);
