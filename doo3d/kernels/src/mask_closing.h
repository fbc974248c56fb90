// Closed gaps of a mask.
#pragma once

#include "bit_image.h"

// A mask whose gaps are closed, in its box with a margin, and the number of its pixels deeper than a distance.
struct ClosedMask {
    Crop crop;
    Index deep = 0;
};

// Return half the widths of a shape, from its middle row on, and check that they and the distance suit an image (height, width).
std::vector<Index> checked_shape(const Vector<Index>& half_widths, double distance, Index height, Index width);

// Close the gaps of a mask by a shape.
ClosedMask closed_mask(const FrameFacts& facts, const std::vector<Index>& shape, double distance);
