#include "runs.h"

#include <algorithm>

namespace {

// An image of numbers with one more pixel on all sides, which hold `beyond`.
template <class T>
struct Bordered {
    Index height, width, pitch;
    std::vector<T> values;

    Bordered(Index height, Index width, T beyond) : height(height), width(width), pitch(width + 2), values((height + 2) * pitch, beyond) {}
    T* row(Index y) { return values.data() + (y + 1) * pitch + 1; }
};

// Take of each pixel and its eight neighbors the extreme one.
template <class Choose>
Bordered<Byte> extreme(Bordered<Byte>& image, Byte beyond, Choose choose) {
    Bordered<Byte> result(image.height, image.width, beyond);
    std::vector<Byte> down(image.pitch);
    for (Index y = 0; y < image.height; ++y) {
        const Byte *upper = image.row(y - 1) - 1, *own = image.row(y) - 1, *lower = image.row(y + 1) - 1;
        for (Index x = 0; x < image.pitch; ++x) down[x] = choose(choose(upper[x], own[x]), lower[x]);
        Byte* to = result.row(y);
        for (Index x = 0; x < image.width; ++x) to[x] = choose(choose(down[x], down[x + 1]), down[x + 2]);
    }
    return result;
}

// Two passes, down and up: the distance of each pixel to the nearest that is 0, or beyond the image, in px / 65536.
Bordered<std::int32_t> distances(Bordered<Byte>& seen) {
    Bordered<std::int32_t> result(seen.height, seen.width, 0);
    const auto next = std::int32_t(std::lround(STRAIGHT * 65536)), across = std::int32_t(std::lround(DIAGONAL * 65536));
    for (Index y = 0; y < seen.height; ++y) {
        const std::int32_t* upper = result.row(y - 1);
        std::int32_t* own = result.row(y);
        for (Index x = 0; x < seen.width; ++x) own[x] = std::min(std::min(upper[x - 1], upper[x + 1]) + across, upper[x] + next);
        for (Index x = 0; x < seen.width; ++x) own[x] = seen.row(y)[x] ? std::min(own[x], own[x - 1] + next) : 0;
    }
    for (Index y = seen.height - 1; y >= 0; --y) {
        const std::int32_t* lower = result.row(y + 1);
        std::int32_t* own = result.row(y);
        for (Index x = 0; x < seen.width; ++x) {
            own[x] = std::min(own[x], std::min(std::min(lower[x - 1], lower[x + 1]) + across, lower[x] + next));
        }
        for (Index x = seen.width; x--;) own[x] = std::min(own[x], own[x + 1] + next);
    }
    return result;
}

auto wide_readings(Matrix<float> depth, Index stride, double scale, double max_depth, double half_width) {
    require(stride > 0, "stride is not over 0");
    const Index height = (Index(depth.shape(0)) + stride - 1) / stride, width = (Index(depth.shape(1)) + stride - 1) / stride;
    Index wide = 0, readings = 0;
    {
        nb::gil_scoped_release released;
        count_visits(height * width);
        const auto at = [&](Index y, Index x) { return depth.data()[y * stride * Index(depth.shape(1)) + x * stride]; };
        Bordered<Byte> seen(height, width, 0);
        for (Index y = 0; y < height; ++y) {
            for (Index x = 0; x < width; ++x) seen.row(y)[x] = at(y, x) > 0;
        }
        Bordered<Byte> grown = extreme(seen, 1, [](Byte a, Byte b) { return std::max(a, b); });
        Bordered<Byte> closed = extreme(grown, 0, [](Byte a, Byte b) { return std::min(a, b); });
        Bordered<std::int32_t> distance = distances(closed);
        const float least = float(half_width), farthest = float(max_depth), size = float(scale);
        for (Index y = 0; y < height; ++y) {
            for (Index x = 0; x < width; ++x) {
                if (!seen.row(y)[x]) continue;
                ++readings;
                wide += float(distance.row(y)[x]) / 65536.0f * (size * std::min(at(y, x), farthest)) > least;
            }
        }
    }
    return std::make_pair(wide, readings);
}

}  // namespace

void bind_wide_readings(Module& m) {
    // Count the readings of a depth image that lie deep inside surfaces, and all readings, in every so many rows and columns.
    //
    // Gaps of one pixel between readings belong to a surface, and what lies beyond the image to none. The distance to a surface's
    // edge is OpenCV's of steps on a 3 x 3 neighborhood.
    //
    // Parameters
    // ----------
    // depth
    //     (H, W) float32 m, 0 = no reading.
    // stride
    //     px between the rows, and columns, that are looked at.
    // scale
    //     sides of such a pixel per m of depth.
    // max_depth
    //     m; a pixel that is farther away has the size of one there.
    // half_width
    //     m from a surface's edge beyond which a reading lies deep inside.
    //
    // Returns
    // -------
    // wide : number of readings deep inside surfaces.
    // readings : number of readings.
    m.def("wide_readings", &wide_readings, "depth"_a.noconvert(), "stride"_a, "scale"_a, "max_depth"_a, "half_width"_a);
}
