// How much of a gap is open or unknown: of paths across gaps, and of straight gaps between many pairs of ends.
#include "position_classes.h"

namespace {

void check_ends(const Matrix<double>& points, const Vector<Index>& first, const Vector<Index>& second) {
    const Index count = points.shape(0);
    require(first.shape(0) == second.shape(0), "first and second have different lengths");
    for (std::size_t k = 0; k < first.shape(0); ++k) {
        require(first(k) >= 0 && first(k) < count && second(k) >= 0 && second(k) < count, "a pair holds no end");
    }
}

auto gap_lengths(Matrix<double> points, Vector<Index> bounds, Vector<Index> classes) {
    check_bounds(bounds, points.shape(0));
    require(classes.shape(0) + 1 >= points.shape(0), "classes are not one per step");
    const Index dim = points.shape(1);
    std::vector<double> lengths(3 * (bounds.shape(0) - 1), 0.0);
    count_visits(points.shape(0));
    for (std::size_t k = 0; k + 1 < bounds.shape(0); ++k) {
        for (Index i = bounds(k); i + 1 < bounds(k + 1); ++i) {
            const Index kind = classes(i);
            const double step = std::sqrt(squared_distance(points.data() + (i + 1) * dim, points.data() + i * dim, dim));
            if (kind == FREE || kind == OUTSIDE) lengths[3 * k] += step;
            if (kind == NO_DEPTH) lengths[3 * k + 1] += step;
            if (kind == BARE) lengths[3 * k + 2] += step;
        }
    }
    return to_numpy(std::move(lengths), bounds.shape(0) - 1, 3);
}

auto straight_gaps(Matrix<double> points, Vector<Index> first, Vector<Index> second, Vector<double> shares) {
    check_ends(points, first, second);
    const Index pairs = first.shape(0), samples = shares.shape(0), dim = points.shape(1);
    std::vector<double> places(pairs * samples * dim);
    count_visits(pairs * samples);
    for (Index i = 0; i < pairs * samples; ++i) {
        const double *start = points.data() + first(i / samples) * dim, *end = points.data() + second(i / samples) * dim;
        for (Index d = 0; d < dim; ++d) places[i * dim + d] = start[d] + shares(i % samples) * (end[d] - start[d]);
    }
    return to_numpy(std::move(places), pairs * samples, dim);
}

auto straight_gap_costs(Matrix<double> points, Vector<Index> first, Vector<Index> second, Vector<Index> classes, double near,
                        double unit_cost, double open_weight, double unknown_weight) {
    check_ends(points, first, second);
    const Index pairs = first.shape(0), dim = points.shape(1), samples = pairs ? Index(classes.shape(0)) / pairs : 0;
    require(Index(classes.shape(0)) == pairs * samples, "classes are not as many for each pair");
    std::vector<double> costs(pairs);
    count_visits(pairs * samples);
    for (Index k = 0; k < pairs; ++k) {
        Index open = 0, unknown = 0;
        for (Index i = k * samples; i < (k + 1) * samples; ++i) {
            open += classes(i) == OUTSIDE || classes(i) == FREE || classes(i) == BARE;
            unknown += classes(i) == NO_DEPTH;
        }
        const double length = std::sqrt(squared_distance(points.data() + second(k) * dim, points.data() + first(k) * dim, dim));
        if (length < near && open == 0) unknown = 0;
        const double number = double(samples);
        costs[k] = unit_cost * length * (open_weight * (double(open) / number) + unknown_weight * (double(unknown) / number));
    }
    return to_numpy(std::move(costs));
}

}  // namespace

void bind_gap_lengths(Module& m) {
    // Return how much of each polyline runs through free space or outside the image, unknown space, and over bare surface.
    //
    // Parameters
    // ----------
    // points, bounds
    //     (N, D) float64, the points of K polylines one after the other, and (K + 1,) int64, the first of each, and N
    // classes
    //     (N - 1,) int64, the class of the middle between each point and the next, as of `classify_positions`, or 6, bare surface
    //
    // Returns
    // -------
    // (K, 3) float64, lengths in the unit of the points
    m.def("gap_lengths", &gap_lengths, "points"_a.noconvert(), "bounds"_a.noconvert(), "classes"_a.noconvert());
    // Return positions on the straight connections of pairs of ends.
    //
    // Parameters
    // ----------
    // points
    //     (E, D) float64, positions of the ends
    // first, second
    //     (K,) int64, the ends of each pair
    // shares
    //     (S,) float64, fractions of the connection, from 0 at the first end
    //
    // Returns
    // -------
    // (K S, D) float64, pair by pair
    m.def("straight_gaps", &straight_gaps, "points"_a.noconvert(), "first"_a.noconvert(), "second"_a.noconvert(), "shares"_a.noconvert());
    // Return the cost of the straight gap between the ends of each pair: its length times the weighted shares of its samples.
    //
    // Parameters
    // ----------
    // points
    //     (E, D) float64, positions of the ends
    // first, second
    //     (K,) int64, the ends of each pair
    // classes
    //     (K S,) int64, class of each of S samples along each pair, as of `straight_gaps`; 0 outside the image, 1 unknown, 5 free
    //     and 6 bare surface count
    // near
    //     distance of two ends below which unknown samples count only if any is open
    // unit_cost
    //     cost per unit of length
    // open_weight, unknown_weight
    //     factors of the share of samples that are outside, free or bare, and of the share that are unknown
    //
    // Returns
    // -------
    // (K,) float64
    m.def("straight_gap_costs", &straight_gap_costs, "points"_a.noconvert(), "first"_a.noconvert(), "second"_a.noconvert(),
          "classes"_a.noconvert(), "near"_a, "unit_cost"_a, "open_weight"_a, "unknown_weight"_a);
}
