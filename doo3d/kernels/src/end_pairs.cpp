#include "arrays.h"

namespace {

// Return the angle between two vectors by the half-angle form of Kahan; `sign` -1 takes the second one reversed.
double angle_between(const double* first, const double* second, Index dim, double sign) {
    double square[2] = {0.0, 0.0};
    for (Index d = 0; d < dim; ++d) {
        square[0] += first[d] * first[d];
        square[1] += second[d] * second[d];
    }
    const double norm[2] = {square[0] > 0 ? std::sqrt(square[0]) : 1.0, square[1] > 0 ? std::sqrt(square[1]) : 1.0};
    double apart = 0.0, together = 0.0;
    for (Index d = 0; d < dim; ++d) {
        const double a = first[d] / norm[0], b = sign * second[d] / norm[1];
        apart += (a - b) * (a - b);
        together += (a + b) * (a + b);
    }
    return 2 * std::atan2(std::sqrt(apart), std::sqrt(together));
}

// The ends of chains: their tangents, and the curvature vectors that no bend sharper than two radii exceeds.
class Ends {
public:
    Ends(Matrix<double> points, Matrix<double> tangents, Matrix<double> curvatures, double radius)
        : points_(points.data()), tangents_(tangents.data()), dim_(points.shape(1)), bends_(curvatures.size()) {
        for (Index i = 0; i < Index(points.shape(0)); ++i) {
            const double* curvature = curvatures.data() + i * dim_;
            double square = 0.0;
            for (Index d = 0; d < dim_; ++d) square += curvature[d] * curvature[d];
            const double share = std::min(1.0, 1 / std::max(2 * radius * std::sqrt(square), 1e-12));
            for (Index d = 0; d < dim_; ++d) bends_[i * dim_ + d] = curvature[d] * share;
        }
    }

    double distance(Index i, Index j) const { return std::sqrt(squared_distance(points_ + j * dim_, points_ + i * dim_, dim_)); }

    // Fill in the tangent that an end is expected to have `ahead` further on, times the share of the curvature that it keeps.
    void expect(Index i, double ahead, double* tangent) const {
        double square = 0.0;
        for (Index d = 0; d < dim_; ++d) {
            tangent[d] = tangents_[i * dim_ + d] + ahead * bends_[i * dim_ + d];
            square += tangent[d] * tangent[d];
        }
        const double norm = square > 0 ? std::sqrt(square) : 1.0;
        for (Index d = 0; d < dim_; ++d) tangent[d] /= norm;
    }

    // Return the angle between a tangent of end i and the straight line to end j.
    double bend(Index i, Index j, const double* tangent) const {
        double gap[3];
        for (Index d = 0; d < dim_; ++d) gap[d] = points_[j * dim_ + d] - points_[i * dim_ + d];
        return angle_between(tangent, gap, dim_, 1.0);
    }

private:
    const double *points_, *tangents_;
    Index dim_;
    std::vector<double> bends_;
};

auto end_pairs(Matrix<double> points, Matrix<double> tangents, Matrix<double> curvatures, double radius, double window, double kept) {
    const Index count = points.shape(0), dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (E, 2) nor (E, 3)");
    require(Index(tangents.shape(0)) == count && Index(tangents.shape(1)) == dim, "tangents are not one per end");
    require(Index(curvatures.shape(0)) == count && Index(curvatures.shape(1)) == dim, "curvatures are not one per end");
    std::vector<double> distances(count * count), turns(count * count), bends(count * count);
    {
        nb::gil_scoped_release released;
        count_visits(count * (count + 1) / 2);
        const Ends ends(points, tangents, curvatures, radius);
        double first[3], second[3];
        for (Index i = 0; i < count; ++i) {
            for (Index j = i; j < count; ++j) {
                const double distance = ends.distance(i, j), ahead = kept * (std::min(distance, window) / 2);
                ends.expect(i, ahead, first);
                ends.expect(j, ahead, second);
                const bool coincide = distance < 1e-12;
                const double bend = coincide ? 0.0 : std::max(ends.bend(i, j, first), ends.bend(j, i, second));
                distances[i * count + j] = distances[j * count + i] = distance;
                turns[i * count + j] = turns[j * count + i] = angle_between(first, second, dim, -1.0);
                bends[i * count + j] = bends[j * count + i] = bend;
            }
        }
    }
    return std::make_tuple(to_numpy(std::move(distances), count, count), to_numpy(std::move(turns), count, count),
                           to_numpy(std::move(bends), count, count));
}

auto limit_pairs(Matrix<double> cost, Matrix<double> distance, Matrix<double> turns, Vector<bool> closed, Vector<bool> exiting,
                 double max_distance, double max_cost, double max_turn, bool allow_closed) {
    const Index count = cost.shape(0);
    const auto is_square = [&](const Matrix<double>& values) { return Index(values.shape(0)) == count && Index(values.shape(1)) == count; };
    require(is_square(cost) && is_square(distance) && is_square(turns), "cost, distance or turns are not (E, E)");
    require(Index(closed.shape(0)) == count && Index(exiting.shape(0)) == count, "closed or exiting are not one per end");
    std::vector<double> limited(count * count, INFINITY);
    count_visits(count * (count + 1) / 2);
    for (Index i = 0; i < count; ++i) {
        for (Index j = i + 1; j < count; ++j) {
            const bool is_far = distance(i, j) > max_distance || cost(i, j) > max_cost || turns(i, j) > max_turn;
            if (is_far || closed(i) || closed(j) || (exiting(i) && exiting(j)) || (!allow_closed && i / 2 == j / 2)) continue;
            limited[i * count + j] = cost(i, j);
        }
    }
    return to_numpy(std::move(limited), count, count);
}

}  // namespace

void bind_end_pairs(Module& m) {
    // Return distance, turn and bend of all pairs of chain ends.
    //
    // Half way to another end, at most half of `window`, an end has the tangent that its curvature leads to: the curvature as far as
    // no bend is sharper than two radii, times `kept`.
    //
    // Parameters
    // ----------
    // points, tangents, curvatures
    //     (E, D) float64, D = 2 or 3: positions of the ends, unit tangents out of their chains, curvature vectors
    // radius, window
    //     radius of the object, and the distance up to which an end keeps bending, in the unit of the points
    // kept
    //     share of its curvature that an end keeps
    //
    // Returns
    // -------
    // distance : (E, E) float64, in the unit of the points, symmetric as all three
    // turn : (E, E) float64 radians, between the tangent of one end half way and that of the other reversed
    // bend : (E, E) float64 radians, the larger of the angles between the tangents half way and the straight connection; 0 for ends
    //     that coincide
    m.def("end_pairs", &end_pairs, "points"_a.noconvert(), "tangents"_a.noconvert(), "curvatures"_a.noconvert(), "radius"_a, "window"_a,
          "kept"_a);
    // Return the cost of joining ends i < j of chains, infinite elsewhere and where a join is not allowed.
    //
    // Parameters
    // ----------
    // cost, distance, turns
    //     (E, E) float64, of each pair
    // closed, exiting
    //     (E,) bool, ends of rings, which are not joined, and ends that leave the view, of which no two are joined
    // max_distance, max_cost, max_turn
    //     values above which a join is not allowed
    // allow_closed
    //     True if the two ends of one chain, 2 c and 2 c + 1, may be joined
    //
    // Returns
    // -------
    // (E, E) float64
    m.def("limit_pairs", &limit_pairs, "cost"_a.noconvert(), "distance"_a.noconvert(), "turns"_a.noconvert(), "closed"_a.noconvert(),
          "exiting"_a.noconvert(), "max_distance"_a, "max_cost"_a, "max_turn"_a, "allow_closed"_a);
}
