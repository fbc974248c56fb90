// A plane in depth: the points near it, and the pixels raised from it.
#include "arrays.h"

#include <algorithm>

namespace {

auto count_near_planes(Matrix<double> points, Matrix<double> normals, Vector<double> offsets, double distance) {
    const Index count = points.shape(0), planes = normals.shape(0);
    require(points.shape(1) == 3 && normals.shape(1) == 3, "points and normals are not (., 3)");
    require(Index(offsets.shape(0)) == planes, "offsets are not one per normal");
    count_visits(count * (1 + planes));
    std::vector<double> axes(3 * count);  // axis by axis, for vector instructions
    for (Index n = 0; n < count; ++n) {
        for (Index d = 0; d < 3; ++d) axes[d * count + n] = points(n, d);
    }
    const double *x = axes.data(), *y = x + count, *z = y + count;
    std::vector<Index> near(planes);
    for (Index k = 0; k < planes; ++k) {
        const double a = normals(k, 0), b = normals(k, 1), c = normals(k, 2), offset = offsets(k);
        Index sum = 0;
        for (Index n = 0; n < count; ++n) sum += std::fabs(x[n] * a + y[n] * b + z[n] * c - offset) < distance;
        near[k] = sum;
    }
    return to_numpy(std::move(near));
}

// The height of a pixel of depth z above the plane is offset - z (along_u + along_v). Pixels above `high` are seeds, from which the
// pixels above `low` are reached.
auto raised_pixels(Matrix<float> depth, Vector<float> along_u, Vector<float> along_v, double offset, double low, double high) {
    const Index height = depth.shape(0), width = depth.shape(1);
    require(Index(along_u.shape(0)) == width, "along_u is not one per column");
    require(Index(along_v.shape(0)) == height, "along_v is not one per row");
    require(low <= high, "low is above high");
    std::vector<float> u(width);
    for (Index c = 0; c < width; ++c) u[c] = along_u(c);
    const float* z = depth.data();
    const float from = float(offset), least = float(low), seed = float(high);
    const auto raised = [&](Index pixel, float v, float column, float limit) {
        return (z[pixel] > 0) & (from - (v + column) * z[pixel] > limit);
    };
    auto* selected = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(selected, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    std::vector<Index> stack;
    count_visits(height * width);
    count_bytes(height * width);
    Visits visits;
    for (Index row = 0; row < height; ++row) {
        const float v = along_v(row);
        int seeds = 0;
        for (Index c = 0; c < width; ++c) seeds += raised(row * width + c, v, u[c], seed);
        for (Index column = 0; seeds && column < width; ++column) {
            const Index start = row * width + column;
            if (!raised(start, v, u[column], seed)) continue;
            --seeds;
            if (selected[start]) continue;
            selected[start] = true;
            stack.push_back(start);
            while (!stack.empty()) {
                const Index r0 = stack.back() / width, c0 = stack.back() % width;
                stack.pop_back();
                ++visits.count;
                for (Index r = std::max<Index>(r0 - 1, 0); r < std::min(r0 + 2, height); ++r) {
                    for (Index c = std::max<Index>(c0 - 1, 0); c < std::min(c0 + 2, width); ++c) {
                        const Index pixel = r * width + c;
                        if (selected[pixel] || !raised(pixel, along_v(r), u[c], least)) continue;
                        selected[pixel] = true;
                        stack.push_back(pixel);
                    }
                }
            }
        }
    }
    return MatrixResult<bool>(selected, {std::size_t(height), std::size_t(width)}, owner);
}

}  // namespace

void bind_plane(nb::module_& m) {
    m.def("count_near_planes", &count_near_planes, "points"_a.noconvert(), "normals"_a.noconvert(), "offsets"_a.noconvert(),
          "distance"_a);
    m.def("raised_pixels", &raised_pixels, "depth"_a.noconvert(), "along_u"_a.noconvert(), "along_v"_a.noconvert(), "offset"_a,
          "low"_a, "high"_a);
}
