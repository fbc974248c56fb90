// Nearest targets of many points.
#include "nearest.h"

namespace {

auto nearest(Matrix<double> points, Matrix<double> targets, double reach) {
    const Index dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(targets.shape(1)) == dim, "points and targets have different numbers of coordinates");
    require(reach > 0, "reach is not positive");
    for (std::size_t k = 0; k < targets.size(); ++k) require(std::isfinite(targets.data()[k]), "a target is not finite");
    ReleasedGil released;
    NearestOfPoints found(points.data(), points.shape(0), targets.data(), targets.shape(0), dim, reach);
    released.end();
    return std::make_tuple(to_numpy(std::move(found.distance)), to_numpy(std::move(found.index)));
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
    m.def("nearest", &nearest, "points"_a.noconvert(), "targets"_a.noconvert(), "reach"_a);
}
