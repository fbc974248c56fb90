#include "bit_image.h"

#include <cstdlib>

namespace {

// An end: its line, its pixel, and the unit vector (row, column) out of the line.
struct LineEnd {
    Index line, pixel;
    double down, right;
};

// Return the number of pixels of an image among the eight around a pixel.
Index count_around(const BitImage& image, Index y, Index x) {
    Index sum = 0;
    for (Index row = std::max<Index>(y - 1, 0); row < std::min(y + 2, image.height); ++row) {
        sum += image.count(row, std::max<Index>(x - 1, 0), std::min(x + 2, image.width));
    }
    return sum - 1;
}

auto line_ends(Vector<Index> pixels, Vector<Index> starts, std::pair<Index, Index> shape, Index window) {
    const auto [height, width] = shape;
    require(height >= 0 && width >= 0 && window >= 0, "shape or window is negative");
    check_bounds(starts, Index(pixels.shape(0)));
    BitImage image(height, width);
    for (std::size_t i = 0; i < pixels.shape(0); ++i) {
        require(pixels(i) >= 0 && pixels(i) < height * width, "a pixel is not in the image");
        image.set(pixels(i) / width, pixels(i) % width);
    }
    std::vector<LineEnd> ends;
    Visits visits{Index(pixels.shape(0))};
    for (Index line = 0; line + 1 < Index(starts.shape(0)); ++line) {
        for (Index i = starts(line); i < starts(line + 1); ++i) {
            const Index y = pixels(i) / width, x = pixels(i) % width;
            if (count_around(image, y, x) != 1) continue;
            Index down = 0, right = 0, count = 0;
            Index k = i;
            while (k > starts(line) && pixels(k - 1) / width >= y - window) --k;
            for (; k < starts(line + 1) && pixels(k) / width <= y + window; ++k, ++visits.count) {
                const Index dy = pixels(k) / width - y, dx = pixels(k) % width - x;
                if (std::abs(dx) > window) continue;
                down += dy + window, right += dx + window, ++count;
            }
            const double back_y = double(down) / double(count) - double(window), back_x = double(right) / double(count) - double(window);
            const double length = std::hypot(back_y, back_x);
            if (length > 0) ends.push_back({line, pixels(i), -back_y / length, -back_x / length});
        }
    }
    std::sort(ends.begin(), ends.end(), [](const LineEnd& a, const LineEnd& b) { return a.pixel < b.pixel; });
    std::vector<Index> lines, positions;
    std::vector<double> directions;
    for (const LineEnd& end : ends) {
        lines.push_back(end.line);
        positions.insert(positions.end(), {end.pixel / width, end.pixel % width});
        directions.insert(directions.end(), {end.down, end.right});
    }
    return std::make_tuple(to_numpy(std::move(lines)), to_numpy(std::move(positions), ends.size(), 2),
                           to_numpy(std::move(directions), ends.size(), 2));
}

}  // namespace

void bind_line_ends(Module& m) {
    // Return the ends of lines one pixel wide: pixels with one pixel of a line among the eight around them.
    //
    // Parameters
    // ----------
    // pixels
    //     (N,) row-major indices of the lines' pixels, line by line, ascending in each
    // starts
    //     (B + 1,) start of each line in `pixels`, and N
    // shape
    //     (H, W) of the image
    // window
    //     px; the direction of an end is that from the mean of its line's pixels within so many rows and columns
    //
    // Returns
    // -------
    // line : (E,) number of each end's line; in row-major order of the ends
    // position : (E, 2) (row, column)
    // direction : (E, 2) unit vector (row, column) out of the line; an end at the mean of its line has none and is left out
    m.def("line_ends", &line_ends, "pixels"_a.noconvert(), "starts"_a.noconvert(), "shape"_a, "window"_a);
}
