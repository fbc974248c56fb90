// The facts of a mask and of the depth in it, made once for all stages.
//
// The mask is read once, into runs: stretches of True pixels in one row. From then on only the runs are visited, and images are of
// the mask's box, so that the work follows the object's pixels and not the frame's. Facts that not every frame needs are made when
// first asked for, and kept.
#pragma once

#include "runs.h"
#include "zeros.h"

#include <memory>

// px: the lengths of the three kinds of steps on a 5 x 5 neighborhood (Borgefors, CVGIP 34, 1986).
constexpr float SIDE = 1.0f, CORNER = 1.4f, KNIGHT = 2.1969f;

// The chamfer distance of a step on the grid, px: by sides and knight's moves, or by corners and knight's moves.
inline float chamfer_length(Index dx, Index dy) {
    const Index far = std::max(dx, dy), near = std::min(dx, dy);
    const Index knights = std::min(near, far - near);
    return float(double(knights) * double(KNIGHT) + double(near - knights) * double(CORNER) + double(far - near - knights) * double(SIDE));
}

// Rows top to bottom and columns left to right that hold the True pixels; the ends are exclusive, and all are 0 if there are none.
struct Box {
    Index top = 0, bottom = 0, left = 0, right = 0;
};

// Return the box of runs in the order of their rows.
Box box_of(const std::vector<Run>& runs);

// Pixels of a medial axis, from the bottom row of the mask to the top, and their distances from its outside, px.
struct MedialAxis {
    std::vector<Index> rows, columns;
    std::vector<float> distances;
};

class FrameFacts {
public:
    static constexpr Index PADDING = 2;  // pixels of outside around the image of distances, as far as a step of its distance goes

    // Facts of a mask without its small components, and with its small holes filled.
    FrameFacts(const Byte* mask, Index height, Index width, Index min_pixels);
    ~FrameFacts();

    const Index height, width;
    Index selected = 0, removed = 0, filled = 0, count = 0;  // pixels at first, of small components, of small holes, and at last
    Box box;
    std::vector<Run> runs;

    Index rows() const { return box.bottom - box.top; }
    Index columns() const { return box.right - box.left; }

    // Call `visit` with the row and the column of each pixel, in row-major order.
    template <class Visit>
    void for_each_pixel(Visit visit) const {
        for (const Run& run : runs) {
            for (Index column = run.start; column < run.end; ++column) visit(Index(run.row), column);
        }
    }

    // The chamfer distance to the outside, px, as an image of the padded box.
    const float* distance();
    const MedialAxis& axis();
    // The pixels left by Zhang-Suen thinning, as row-major indices in the box with one pixel around it, ascending.
    const std::vector<Index>& skeleton();
    // Tell for each of `count` pixels (u, v) whether its distance is at least `fraction` of the largest within `reach` px of it in rows
    // and columns, or at most `margin` less. Pixels outside of the mask are in no core.
    std::vector<Byte> in_core(const Index* pixels, Index count, Index reach, float fraction, float margin);
    // Tell for each of `count` pixels (u, v) whether its chamfer distance from the skeleton is below `reach` px.
    std::vector<Byte> near_skeleton(const Index* pixels, Index count, double reach);

private:
    // Call `visit` with the row, the first column and the number of columns within `reach` of the runs of a row, all in the box.
    template <class Visit>
    void for_each_widened(Index reach, Visit visit) const;
    float* distance_at(Index row, Index column);
    void remove_components(Index min_pixels);
    void fill_holes(Index min_pixels);

    std::unique_ptr<Zeros<float>> distance_;
    MedialAxis axis_;
    std::vector<Index> skeleton_;
    bool has_axis_ = false;
};
