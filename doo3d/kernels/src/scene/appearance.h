// Cells of colors: 16 levels of each channel, the blue one last.
#pragma once

#include "arrays.h"

constexpr Index COLOR_LEVELS = 16;  // of 256 values
constexpr Index color_cells() { return COLOR_LEVELS * COLOR_LEVELS * COLOR_LEVELS; }

inline Index color_cell(const Byte* rgb) {
    const auto level = [](Byte value) { return Index(value) * COLOR_LEVELS / 256; };
    return (level(rgb[0]) * COLOR_LEVELS + level(rgb[1])) * COLOR_LEVELS + level(rgb[2]);
}
