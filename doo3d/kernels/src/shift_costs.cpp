// How far a polyline lies from another at the best shift of one along the other.
#include "arrays.h"

#include <algorithm>
#include <utility>

namespace {

// Tell whether the boxes around two polylines are further apart than `reach` along an axis.
bool are_apart(const StridedMatrix<double>& first, const StridedMatrix<double>& second, double reach) {
    for (std::size_t d = 0; d < first.shape(1); ++d) {
        double low[2], high[2];
        for (const auto& [lines, k] : {std::pair(&first, 0), std::pair(&second, 1)}) {
            low[k] = high[k] = (*lines)(0, d);
            for (std::size_t i = 1; i < lines->shape(0); ++i) {
                low[k] = std::min(low[k], (*lines)(i, d));
                high[k] = std::max(high[k], (*lines)(i, d));
            }
        }
        if (std::max(low[0], low[1]) - std::min(high[0], high[1]) > reach) return true;
    }
    return false;
}

// Return points at equal steps of the joints' numbers, as `Chain.nodes` does.
std::vector<double> nodes(const StridedMatrix<double>& joints, Index count) {
    const Index dim = joints.shape(1), last = Index(joints.shape(0)) - 1;
    std::vector<double> points(count * dim);
    for (Index k = 0; k < count; ++k) {
        const double at = k == count - 1 ? double(last) : double(k) * (double(last) / double(count - 1));
        const Index i = std::min(Index(at), last - 1);
        const double part = at - double(i);
        for (Index d = 0; d < dim; ++d) points[k * dim + d] = joints(i, d) * (1 - part) + joints(i + 1, d) * part;
    }
    return points;
}

// Return the least cost of the shifts whose summed distances are given, from that by 1 - rows points on.
double least_cost(const std::vector<double>& sums, Index rows, Index columns, double limit) {
    const Index min_overlap = (std::min(rows, columns) + 1) / 2;
    double best = INFINITY;
    for (Index shift = min_overlap - rows; shift <= columns - min_overlap; ++shift) {
        const double overlap = double(std::min(rows, columns - shift) - std::max<Index>(0, -shift));
        const double unmatched = double(rows + columns) / 2 - overlap;
        best = least(best, (sums[shift + rows - 1] / limit + unmatched) / (overlap + unmatched));
    }
    return best;
}

std::pair<double, double> shift_costs(StridedMatrix<double> first, StridedMatrix<double> second, std::pair<Index, Index> counts,
                                      double limit) {
    const auto [rows, columns] = counts;
    const Index dim = first.shape(1);
    require(second.shape(1) == first.shape(1), "the polylines have different numbers of coordinates");
    require(first.shape(0) >= 2 && second.shape(0) >= 2, "a polyline has fewer than two points");
    require(rows >= 2 && columns >= 2 && rows <= 10000 && columns <= 10000, "counts are not from 2 to 10000");
    nb::gil_scoped_release released;
    count_visits(Index(first.shape(0) + second.shape(0)));
    if (are_apart(first, second, limit)) return {INFINITY, INFINITY};
    const std::vector<double> from = nodes(first, rows), to = nodes(second, columns);
    std::vector<double> forward(rows + columns - 1), backward(rows + columns - 1);
    count_visits(rows * columns);
    for (Index r = 0; r < rows; ++r) {
        for (Index c = 0; c < columns; ++c) {
            const double distance = std::sqrt(squared_distance(from.data() + r * dim, to.data() + c * dim, dim));
            forward[c - r + rows - 1] += distance;
            backward[columns - 1 - c - r + rows - 1] += distance;
        }
    }
    return {least_cost(forward, rows, columns, limit), least_cost(backward, rows, columns, limit)};
}

}  // namespace

void bind_shift_costs(Module& m) {
    // Return the cost of matching a polyline with another at the best shift along it, and with the other turned around.
    //
    // The polylines are compared at evenly spaced points, which are shifted by whole points against each other and overlap by at
    // least half of the fewer. The cost is the mean of their distances over `limit`; a point without a counterpart counts 1/2.
    //
    // Parameters
    // ----------
    // first, second
    //     (P, D) and (Q, D) float64, P, Q >= 2, of any layout
    // counts
    //     number of points at which each of the two is compared, 2 to 10000
    // limit
    //     greatest distance, in the unit of the points; both costs are infinite if a gap between the boxes around the polylines is
    //     larger
    m.def("shift_costs", &shift_costs, "first"_a.noconvert(), "second"_a.noconvert(), "counts"_a, "limit"_a);
}
