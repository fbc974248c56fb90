// Nearest targets of many points, and how the points around some places spread.
#include "nearest.h"

namespace {

auto nearest(Matrix<double> points, Matrix<double> targets, double reach) {
    const Index dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(targets.shape(1)) == dim, "points and targets have different numbers of coordinates");
    require(reach > 0, "reach is not positive");
    for (std::size_t k = 0; k < targets.size(); ++k) require(std::isfinite(targets.data()[k]), "a target is not finite");
    NearestOfPoints found(points.data(), points.shape(0), targets.data(), targets.shape(0), dim, reach);
    return std::make_tuple(std::move(found.distance), std::move(found.index));
}

// Of points in the order of their first coordinate those beside a center along it are looked at.
auto neighborhood_sums(Matrix<double> points, Matrix<double> centers, double reach) {
    const Index count = points.shape(0), size = centers.shape(0);
    require(points.shape(1) == 3 && centers.shape(1) == 3, "points and centers are not (., 3)");
    for (Index n = 1; n < count; ++n) require(points(n - 1, 0) <= points(n, 0), "points are not in the order of their first coordinate");
    std::vector<double> first(count), sums(13 * size);
    for (Index n = 0; n < count; ++n) first[n] = points(n, 0);
    Visits visits{count};
    for (Index s = 0; s < size; ++s) {
        const double* center = centers.data() + 3 * s;
        const Index begin = std::lower_bound(first.begin(), first.end(), center[0] - reach) - first.begin();
        const Index end = std::upper_bound(first.begin(), first.end(), center[0] + reach) - first.begin();
        std::array<double, 13> sum{};  // of 1, the offset, and the products of its coordinates
        visits.count += end - begin;
        for (const double* point = points.data() + 3 * begin; point < points.data() + 3 * end; point += 3) {
            const double offset[3] = {point[0] - center[0], point[1] - center[1], point[2] - center[2]};
            if (!(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2] <= reach * reach)) continue;
            sum[0] += 1;
            for (Index i = 0; i < 3; ++i) {
                sum[1 + i] += offset[i];
                for (Index j = 0; j < 3; ++j) sum[4 + 3 * i + j] += offset[i] * offset[j];
            }
        }
        std::copy(sum.begin(), sum.end(), &sums[13 * s]);
    }
    return rows_of(std::move(sums), 13);
}

}  // namespace

void bind_nearest(Module& m) {
    // Find the nearest target of each point within a reach; of several equally near, the one with the lowest index.
    //
    // Parameters
    // ----------
    // points
    //     (N, D) float64, N points, D = 2 or 3; the search is quick if each is near the one before it
    // targets
    //     (S, D) float64, S targets, finite, in the unit of the points
    // reach
    //     greatest distance, over 0, may be infinite
    //
    // Returns
    // -------
    // distance : (N,) float64; infinite without a target within reach, as for a point that is not finite
    // index : (N,) int64, index of the nearest target; 0 where the distance is infinite
    m.def("nearest", &nearest, "points"_array, "targets"_array, "reach"_a);
    // Sum 1, the offsets and the products of their coordinates over the points within `reach` of each of S centers.
    //
    // points : (N, 3) float64, in the order of their first coordinate. centers : (S, 3) float64, in their unit. Returns (S, 13)
    // float64: the number, the sums of three offsets, and those of the 3 x 3 products, row by row.
    m.def("neighborhood_sums", &neighborhood_sums, "points"_array, "centers"_array, "reach"_a);
}
