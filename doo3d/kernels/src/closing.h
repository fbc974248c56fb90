// Morphological closing of a sparse grid of cells, each given by its row-major index in a box.
#pragma once

#include "arrays.h"

// Return the ascending keys of the cells in a box that are occupied after closing with a cube of 2 `iterations` + 1 cells, those given
// among them. More than `iterations` layers of cells at every face of the box must be empty.
std::vector<Index> close_cells(const std::vector<Index>& keys, const std::vector<Index>& shape, Index iterations);
