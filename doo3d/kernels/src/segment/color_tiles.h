// How much an image differs in color from the surface around, tile by tile.
#pragma once

#include "bit_image.h"

constexpr Index TILE = 8, REACH = 2, WIDE = TILE + 2 * REACH;  // px; the blur and the rule for edges reach so far

struct Thresholds {
    float grow, seed, seed_share, shadow_light, edge_share;
};

// Two pixels of a smaller image, and the share of the second one.
struct Between {
    Index first, second;
    float share;
};

class ColorTiles {
   public:
    const Thresholds limits;
    const Index height, width, rows, columns;
    BitImage differing, seeds;  // pixels that differ from the surface, and that are well above it

    // color : (height, width, 3) RGB. around : the surface's color in CIELAB, of a smaller image. deviation : (3,) of that, the unit of contrast.
    ColorTiles(const Volume<Byte>& color, const Volume<float>& around, const Vector<double>& deviation, const Thresholds& limits);
    ~ColorTiles();

    bool is_evaluated(Index tile) const { return is_evaluated_[tile]; }
    void evaluate(Index tile);
    // Return the squared contrasts of the pixels of a row from a column on, in deviations, with REACH pixels beyond the image around; 0 there
    // and in tiles that were not evaluated.
    const float* contrast(Index row, Index column) const { return contrast_.data() + (row + REACH) * pitch_ + column + REACH; }

   private:
    using Plane = float[CHANNELS][TILE];  // a row of a tile, channel by channel

    void blur_along_rows(Index top, Index left, Plane (&across)[WIDE]) const;
    void surface_row(Index row, Index left, Plane& base) const;

    const Volume<Byte>& color_;
    const Volume<float>& around_;
    const Index pitch_;
    Zeros<float> contrast_;
    std::vector<Byte> is_evaluated_;
    float scale_[CHANNELS];
    const std::vector<Between> along_, down_;
};
