// A plane in depth: the points near it, and the pixels raised from it.
#include "runs.h"

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

enum Level : Byte { NONE, LOW, SEED };

// The height of a pixel of depth z above the plane is offset - z (along_u + along_v). Pixels above `high` are seeds, from which the
// pixels above `low` are reached.
WITH_AVX2 void find_levels(const float* __restrict depth, const float* __restrict along_u, float along_v, float offset, float low, float high,
                           Index width, Byte* __restrict levels) {
    for (Index c = 0; c < width; ++c) {
        const float z = depth[c], height = offset - (along_v + along_u[c]) * z;
        levels[c] = Byte(Byte((z > 0) & (height > low)) + Byte((z > 0) & (height > high)));
    }
}

// Set the pixels of the components with a seed to 1 and all others to 0.
void reach_from_seeds(Byte* levels, Index height, Index width) {
    const std::vector<Run> runs = runs_of(levels, height, width);
    RunSets sets = connected(runs, 1);
    std::vector<Byte> has_seed(runs.size(), 0);
    count_visits(Index(runs.size()));
    const auto pixels = [&](const Run& run) { return levels + run.row * width + run.start; };
    const auto size = [](const Run& run) { return std::size_t(run.end - run.start); };
    for (std::size_t i = 0; i < runs.size(); ++i) {
        has_seed[sets.root(std::int32_t(i))] |= std::memchr(pixels(runs[i]), SEED, size(runs[i])) != nullptr;
    }
    for (std::size_t i = 0; i < runs.size(); ++i) std::memset(pixels(runs[i]), has_seed[sets.root(std::int32_t(i))], size(runs[i]));
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
        std::vector<float> u(width);
        for (Index c = 0; c < width; ++c) u[c] = along_u(c);
        for (Index row = 0; row < height; ++row) {
            find_levels(depth.data() + row * width, u.data(), along_v(row), float(offset), float(low), float(high), width, levels + row * width);
        }
        reach_from_seeds(levels, height, width);
    }
    return MatrixResult<bool>(selected, {std::size_t(height), std::size_t(width)}, owner);
}

}  // namespace

void bind_plane(Module& m) {
    // Return the index of the plane that has the most points nearer than `distance`, the first of several.
    //
    // points : (N, 3) float64 m. normals : (Q, 3) float64 unit, normals of Q planes, at least one. offsets : (Q,) float64 m; points
    // p on a plane have normal @ p = offset. distance : m.
    m.def("best_plane", &best_plane, "points"_a.noconvert(), "normals"_a.noconvert(), "offsets"_a.noconvert(),
          "distance"_a);
    // Select the pixels raised from a plane towards the camera: hysteresis threshold of their height.
    //
    // A pixel of depth z lies offset - z (along_u + along_v) above the plane. Pixels higher than `high` are selected, and pixels
    // higher than `low` that are connected to these by pixels higher than `low`, along rows, columns or diagonals.
    //
    // Parameters
    // ----------
    // depth
    //     (H, W) float32 m, 0 = no reading, which is never selected
    // along_u, along_v
    //     (W,) and (H,) float32; their sum is the product of the plane's normal with the ray through the pixel, scaled to z = 1
    // offset
    //     m; points p on the plane have normal @ p = offset, and the normal points away from the camera
    // low, high
    //     m, the thresholds, low <= high
    //
    // Returns
    // -------
    // (H, W) bool
    m.def("raised_pixels", &raised_pixels, "depth"_a.noconvert(), "along_u"_a.noconvert(), "along_v"_a.noconvert(), "offset"_a,
          "low"_a, "high"_a);
}
