// Zhang-Suen thinning of an image of neighborhoods.
#pragma once

#include "arrays.h"

// A neighborhood is a bit set: bit k is the neighbor P(k + 2) of Zhang and Suen, clockwise from above.
constexpr int RING_ROWS[8] = {-1, -1, 0, 1, 1, 1, 0, -1}, RING_COLUMNS[8] = {0, 1, 1, 1, 0, -1, -1, -1};

// Thin the pixels of an image to lines one pixel wide. Deleted pixels get the code 0.
//
// codes : the neighborhood of each pixel of the object in row-major order, 0 elsewhere; the object does not reach the border.
// active : ascending indices of the pixels of the object.
void thin_codes(Byte* codes, Index width, std::vector<std::int32_t> active);
