// Images turned so that a direction is horizontal, with interpolation between pixels.
#pragma once

#include "arrays.h"

constexpr Index PLANES = CHANNELS + 1;  // channels and the sum of their squares

// An image of PLANES numbers a pixel less the mean color, the last of them 0, with its last row and column twice.
struct Centered {
    Index height, width;
    float square = 1.0f;  // the largest sum of squares of a pixel
    std::vector<float> values;

    explicit Centered(const Volume<float>& image);
};

// Where positions lie between pixels: the pixel above and to the left, and how far to the next ones.
struct BetweenPixels {
    std::vector<std::int32_t> pixel;
    std::vector<float> along, down;
};

// A line of positions in an image whose last pixel is at `last` and whose rows have `stride` pixels.
struct PositionLine {
    struct Position {
        float u, v;
    };
    Position start, step, last;
    std::int32_t stride;
};

// The image turned so that a direction is horizontal, on the smallest grid that holds all of it.
class Turned {
   public:
    Index height, width;

    Turned(const Centered& image, double angle);
    // The rows of a column that are looked at: those within a margin of the image's pixels; the last one is exclusive.
    std::pair<Index, Index> rows(Index column) const;
    // Write the pixels of a row of the turned image; those beyond the image repeat its border.
    void read(Index row, Index first, Index last, float* pixels);
    // Turn scores back: between the pixels, and the width of the nearest one.
    void turn_back(const float* scores, const Byte* widths, float* score, Byte* which);

   private:
    const Centered& image;
    double cos, sin, u0, v0;  // and where the first pixel lies in the image
    BetweenPixels between;

    void place(Index count, const PositionLine& line);
};
