#include "arrays.h"

namespace {

// An end: its position, its tangent and the bend of its continuation across the view, and the direction from the camera to it.
struct Ahead {
    const double *point, *tangent, *bend, *towards;
    double radius, reach;
};

// What may differ from the continuation of an end, as the parameters of `strands_ahead` say.
struct Limits {
    double depth_slope, max_miss, max_behind, max_behind_share;
};

// Tell whether a sample lies along the continuation of an end.
template <Index DIM>
bool is_ahead(const Ahead& end, const double* sample, double sample_radius, const Limits& limits) {
    const double both = sample_radius + end.radius, reach = (sample_radius + end.reach) * (1 + 1e-9);  // and rounding
    double offset[DIM], square = 0.0;
    for (Index d = 0; d < DIM; ++d) {
        offset[d] = sample[d] - end.point[d];
        square += offset[d] * offset[d];
    }
    if (end.towards) {
        double depth = 0.0;
        for (Index d = 0; d < DIM; ++d) depth += offset[d] * end.towards[d];
        const double beside = std::sqrt(std::max(0.0, square - depth * depth));
        const double certain = std::max(0.0, std::fabs(depth) - limits.depth_slope * std::max(0.0, beside - both));
        const double free = std::fabs(depth) - certain;
        for (Index d = 0; d < DIM; ++d) offset[d] -= std::copysign(free, depth) * end.towards[d];
        square = beside * beside + certain * certain;
    }
    if (!(square <= reach * reach)) return false;
    double ahead = 0.0, miss = 0.0;
    for (Index d = 0; d < DIM; ++d) ahead += offset[d] * end.tangent[d];
    if (-ahead - both > (limits.max_behind + limits.max_behind_share * both) * (1 + 1e-9)) return false;
    const double bent = 0.5 * std::max(ahead, 0.0) * std::max(ahead, 0.0);
    for (Index d = 0; d < DIM; ++d) {
        const double beside = offset[d] - ahead * end.tangent[d] - bent * end.bend[d];
        miss += beside * beside;
    }
    return std::sqrt(miss) <= limits.max_miss * both * (1 + 1e-9);
}

auto strands_ahead(Matrix<double> points, Matrix<double> tangents, Matrix<double> bends, Matrix<double> towards, Vector<double> radii,
                   Vector<double> reach, Matrix<double> samples, Vector<double> sample_radii, Vector<Index> bounds, double depth_slope,
                   double max_miss, double max_behind, double max_behind_share) {
    const Index count = points.shape(0), dim = points.shape(1), chains = Index(bounds.shape(0)) - 1;
    require(dim == 2 || dim == 3, "points are neither (E, 2) nor (E, 3)");
    for (const auto& each : {tangents, bends}) {
        require(Index(each.shape(0)) == count && Index(each.shape(1)) == dim, "tangents or bends are not one per end");
    }
    require(towards.shape(0) == 0 || (Index(towards.shape(0)) == count && Index(towards.shape(1)) == dim), "towards are not one per end");
    require(Index(radii.shape(0)) == count && Index(reach.shape(0)) == count, "radii or reach are not one per end");
    require(Index(samples.shape(1)) == dim && samples.shape(0) == sample_radii.shape(0), "samples do not fit the points or their radii");
    check_bounds(bounds, samples.shape(0));
    const Limits limits{depth_slope, max_miss, max_behind, max_behind_share};
    const auto test = dim == 3 ? is_ahead<3> : is_ahead<2>;
    std::vector<Byte> found(count * chains);
    {
        nb::gil_scoped_release released;
        Visits visits;
        for (Index e = 0; e < count; ++e) {
            const double* view = towards.shape(0) ? towards.data() + e * dim : nullptr;
            const Ahead end{points.data() + e * dim, tangents.data() + e * dim, bends.data() + e * dim, view, radii(e), reach(e)};
            for (Index c = 0; c < chains; ++c) {
                Index s = bounds(c);
                while (s < bounds(c + 1) && !test(end, samples.data() + s * dim, sample_radii(s), limits)) ++s;
                found[e * chains + c] = s < bounds(c + 1);
                visits.count += s - bounds(c) + found[e * chains + c];
            }
        }
    }
    return to_numpy_bool(found, count, chains);
}

}  // namespace

void bind_strands_ahead(Module& m) {
    // Tell which strands have a sample along the continuation of an end.
    //
    // The end is extrapolated along its tangent with its curvature, behind it straight along its tangent. A strand is ahead of the
    // end if a sample of it lies within the reach of the end, misses the continuation by little, and is not far behind the end.
    //
    // Parameters
    // ----------
    // points, tangents, bends
    //     (E, D) float64, D = 2 or 3: positions of the ends, unit tangents out of their chains, expected curvature vectors
    // towards
    //     (E, D) float64, unit vectors from the camera to the ends, along which distances count less; (0, D) if there is no camera
    // radii, reach
    //     (E,) float64, radius of the strand at each end, and distance of a sample beyond its radius at most
    // samples, sample_radii
    //     (S, D) and (S,) float64, positions and radii of the samples of C chains, one chain after the other
    // bounds
    //     (C + 1,) int64; chain c has the samples [bounds[c]:bounds[c + 1]], the last entry is S
    // depth_slope
    //     difference in depth that does not count, as a share of the distance across the view beyond the sum of both radii
    // max_miss
    //     distance of a sample from the continuation at most, in sums of both radii
    // max_behind, max_behind_share
    //     distance of a sample behind the end at most, beyond the sum of both radii: in the unit of the points, and in such sums
    //
    // Returns
    // -------
    // (E, C) bool
    m.def("strands_ahead", &strands_ahead, "points"_a.noconvert(), "tangents"_a.noconvert(), "bends"_a.noconvert(), "towards"_a.noconvert(),
          "radii"_a.noconvert(), "reach"_a.noconvert(), "samples"_a.noconvert(), "sample_radii"_a.noconvert(), "bounds"_a.noconvert(),
          "depth_slope"_a, "max_miss"_a, "max_behind"_a, "max_behind_share"_a);
}
