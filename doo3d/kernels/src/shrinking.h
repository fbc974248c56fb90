// Images of colors scaled down by 2 and by 4, the same numbers as OpenCV's INTER_AREA.
#pragma once

#include "arrays.h"

#include <algorithm>

// An image of bytes (height, width, 3).
struct Colors {
    Index height, width;
    std::vector<Byte> bytes;

    Colors(Index height, Index width) : height(height), width(width), bytes(height * width * CHANNELS) {}
    Byte* at(Index row, Index column) { return bytes.data() + (row * width + column) * CHANNELS; }
};

// Return an image scaled down by 2, by sides that are rounded down but not below 1. A pixel is the mean of those it covers, each with
// the share that is covered. Of two by two it is rounded up in the middle between two numbers, of others to the even one.
Colors halved(const Byte* image, Index height, Index width);

// Return an image scaled down by 2 twice, in one pass where its sides are multiples of 4.
Colors quartered(const Byte* image, Index height, Index width);
