// A plane in depth: the points near it, and the pixels raised from it.
#include "arrays.h"

#include <algorithm>

namespace {

constexpr Index BLOCK = 64;  // points or pixels at a time, for vector instructions

// The search of a plane ends as soon as the rest of the points cannot make it better than the best before.
Index best_plane(StridedMatrix<double> points, Matrix<double> normals, Vector<double> offsets, double distance) {
    const Index count = points.shape(0), planes = normals.shape(0);
    require(points.shape(1) == 3 && normals.shape(1) == 3, "points and normals are not (., 3)");
    require(Index(offsets.shape(0)) == planes && planes > 0, "offsets are not one per normal, or there are none");
    nb::gil_scoped_release released;
    std::vector<double> axes(3 * count);  // axis by axis, for vector instructions
    for (Index n = 0; n < count; ++n) {
        for (Index d = 0; d < 3; ++d) axes[d * count + n] = points(n, d);
    }
    const double *x = axes.data(), *y = x + count, *z = y + count;
    Index best = 0, most_near = -1;
    Visits visits{count};
    for (Index k = 0; k < planes; ++k) {
        const double a = normals(k, 0), b = normals(k, 1), c = normals(k, 2), offset = offsets(k);
        Index near = 0;
        for (Index first = 0; first < count && near + count - first > most_near; first += BLOCK) {
            int sum = 0;
            for (Index n = first; n < std::min(first + BLOCK, count); ++n) sum += std::fabs(x[n] * a + y[n] * b + z[n] * c - offset) < distance;
            near += sum;
            visits.count += BLOCK;
        }
        if (near <= most_near) continue;
        best = k;
        most_near = near;
    }
    return best;
}

enum Level : Byte { NONE, LOW, SEED, REACHED };

// The height of a pixel of depth z above the plane is offset - z (along_u + along_v). Pixels above `high` are seeds, from which the
// pixels above `low` are reached.
void find_levels(const float* depth, const float* along_u, float along_v, float offset, float low, float high, Index width, Byte* levels) {
    std::int32_t level[BLOCK];
    for (Index first = 0; first < width; first += BLOCK) {
        const Index count = std::min(BLOCK, width - first);
        for (Index c = 0; c < count; ++c) {
            const float z = depth[first + c], height = offset - (along_v + along_u[first + c]) * z;
            level[c] = std::int32_t((z > 0) & (height > low)) + std::int32_t((z > 0) & (height > high));
        }
        for (Index c = 0; c < count; ++c) levels[first + c] = Byte(level[c]);
    }
}

void reach(Byte* levels, Index height, Index width, Index start, std::vector<Index>& stack) {
    levels[start] = REACHED;
    stack.assign(1, start);
    while (!stack.empty()) {
        const Index row = stack.back() / width, column = stack.back() % width;
        stack.pop_back();
        for (Index r = std::max<Index>(row - 1, 0); r < std::min(row + 2, height); ++r) {
            for (Index c = std::max<Index>(column - 1, 0); c < std::min(column + 2, width); ++c) {
                Byte& level = levels[r * width + c];
                if (level == NONE || level == REACHED) continue;
                level = REACHED;
                stack.push_back(r * width + c);
            }
        }
    }
}

auto raised_pixels(Matrix<float> depth, Vector<float> along_u, Vector<float> along_v, double offset, double low, double high) {
    const Index height = depth.shape(0), width = depth.shape(1), size = height * width;
    require(Index(along_u.shape(0)) == width, "along_u is not one per column");
    require(Index(along_v.shape(0)) == height, "along_v is not one per row");
    require(low <= high, "low is above high");
    auto* selected = new bool[std::max<Index>(size, 1)];
    nb::capsule owner(selected, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    {
        nb::gil_scoped_release released;
        auto* levels = reinterpret_cast<Byte*>(selected);
        count_visits(size);
        count_bytes(size);
        std::vector<float> u(width);
        for (Index c = 0; c < width; ++c) u[c] = along_u(c);
        for (Index row = 0; row < height; ++row) {
            find_levels(depth.data() + row * width, u.data(), along_v(row), float(offset), float(low), float(high), width, levels + row * width);
        }
        std::vector<Index> stack;
        for (Index i = first_set(levels, 0, size); i < size; i = first_set(levels, i + 1, size)) {
            if (levels[i] == SEED) reach(levels, height, width, i, stack);
        }
        for (Index i = 0; i < size; ++i) levels[i] = Byte(levels[i] == REACHED);
    }
    return MatrixResult<bool>(selected, {std::size_t(height), std::size_t(width)}, owner);
}

}  // namespace

void bind_plane(nb::module_& m) {
    m.def("best_plane", &best_plane, "points"_a.noconvert(), "normals"_a.noconvert(), "offsets"_a.noconvert(),
          "distance"_a);
    m.def("raised_pixels", &raised_pixels, "depth"_a.noconvert(), "along_u"_a.noconvert(), "along_v"_a.noconvert(), "offset"_a,
          "low"_a, "high"_a);
}
