#include "arrays.h"

#include <algorithm>

namespace {

// Every other joint of a chain, coordinate by coordinate, and how far each gives way.
struct Joints {
    std::vector<std::vector<double>> coordinates;
    std::vector<double> mobility;

    Joints(const Matrix<double>& joints, const Vector<double>& given, Index first) : coordinates(joints.shape(1)) {
        for (Index k = first; k < Index(joints.shape(0)); k += 2) {
            for (std::size_t d = 0; d < coordinates.size(); ++d) coordinates[d].push_back(joints.data()[k * joints.shape(1) + d]);
            mobility.push_back(given(k));
        }
    }
};

// Move joints and those that follow them, others from number `next` on, towards or from each other, each by its share of the mobility.
// Return by how much the worst distance missed the length. All pairs are moved at once: they have no joint in common.
WITH_AVX2 double equalize(Joints& joints, Joints& others, Index next, double length, std::vector<double>& scales) {
    const Index pairs = std::min(Index(joints.mobility.size()), Index(others.mobility.size()) - next);
    const double* __restrict mobility = joints.mobility.data();
    const double* __restrict other_mobility = others.mobility.data() + next;
    double* __restrict scale = scales.data();
    std::fill_n(scale, std::max<Index>(pairs, 0), 0.0);
    for (std::size_t d = 0; d < joints.coordinates.size(); ++d) {
        const double* __restrict a = joints.coordinates[d].data();
        const double* __restrict b = others.coordinates[d].data() + next;
        for (Index k = 0; k < pairs; ++k) scale[k] += (b[k] - a[k]) * (b[k] - a[k]);
    }
    double worst = 0.0;
    for (Index k = 0; k < pairs; ++k) scale[k] = std::sqrt(scale[k]);
    for (Index k = 0; k < pairs; ++k) worst = most(worst, std::abs(scale[k] - length));
    for (Index k = 0; k < pairs; ++k) {
        const double distance = scale[k], share = mobility[k] + other_mobility[k], part = (distance - length) / distance / share;
        scale[k] = (distance > 0) & (share > 0) ? part : 0.0;
    }
    for (std::size_t d = 0; d < joints.coordinates.size(); ++d) {
        double* __restrict a = joints.coordinates[d].data();
        double* __restrict b = others.coordinates[d].data() + next;
        for (Index k = 0; k < pairs; ++k) {
            const double step = (b[k] - a[k]) * scale[k];
            a[k] += mobility[k] * step;
            b[k] -= other_mobility[k] * step;
        }
    }
    return worst;
}

// Even segments come first, then odd ones, so that neither end of the chain is preferred.
auto equalize_lengths(Matrix<double> joints, double length, Vector<double> mobility, Index rounds, double tolerance) {
    const Index count = joints.shape(0), dim = joints.shape(1);
    require(Index(mobility.shape(0)) == count, "mobility is not one value per joint");
    ReleasedGil released;
    Joints even(joints, mobility, 0), odd(joints, mobility, 1);
    std::vector<double> scales(even.mobility.size()), moved(count * dim);
    for (Index round = 0; round < rounds; ++round) {
        count_visits(count);
        const double worst = equalize(even, odd, 0, length, scales);
        if (most(worst, equalize(odd, even, 1, length, scales)) < tolerance * length) break;
    }
    for (Index k = 0; k < count; ++k) {
        for (Index d = 0; d < dim; ++d) moved[k * dim + d] = (k % 2 ? odd : even).coordinates[d][k / 2];
    }
    released.end();
    return to_numpy(std::move(moved), count, dim);
}

// The directions of the segments between joints, and by how much each is too long; one of no length has the direction of that before.
struct Segments {
    std::vector<double> directions, excess;

    Segments(const std::vector<double>& joints, Index count, Index dim, double length)
        : directions(std::max<Index>(count - 1, 0) * dim, 0.0), excess(std::max<Index>(count - 1, 0)) {
        for (Index k = 0; k + 1 < count; ++k) {
            const double* a = joints.data() + k * dim;
            double* u = directions.data() + k * dim;
            const double distance = std::sqrt(squared_distance(a, a + dim, dim));
            for (Index d = 0; d < dim; ++d) u[d] = distance > 0 ? (a[d + dim] - a[d]) / distance : k ? u[d - dim] : double(d == 0);
            excess[k] = distance - length;
        }
    }
    double worst() const {
        double result = 0.0;
        for (const double each : excess) result = most(result, std::abs(each));
        return result;
    }
};

// Return the tensions of segments by which their joints move least and each loses its excess, to first order: the matrix is tridiagonal,
// with 2 on the diagonal and less than 1 beside it, and is solved by elimination from the first segment to the last, and back.
std::vector<double> tensions(const Segments& segments, Index dim) {
    const Index count = Index(segments.excess.size());
    std::vector<double> beside(count, 0.0), pivot(count), result = segments.excess;
    for (Index k = 0; k < count; ++k) {
        pivot[k] = 2.0;
        if (!k) continue;
        const double* u = segments.directions.data() + k * dim;
        for (Index d = 0; d < dim; ++d) beside[k] -= u[d] * u[d - dim];
        const double factor = beside[k] / pivot[k - 1];
        pivot[k] -= factor * beside[k];
        result[k] -= factor * result[k - 1];
    }
    for (Index k = count - 1; k >= 0; --k) {
        result[k] = (result[k] - (k + 1 < count ? beside[k + 1] * result[k + 1] : 0.0)) / pivot[k];
    }
    return result;
}

// Move joints, each along the tensions beside it, and none farther than a length.
void move(std::vector<double>& joints, const Segments& segments, Index count, Index dim, double length) {
    const std::vector<double> tension = tensions(segments, dim);
    std::vector<double> steps(joints.size(), 0.0);
    for (Index k = 0; k + 1 < count; ++k) {
        for (Index d = 0; d < dim; ++d) {
            const double step = tension[k] * segments.directions[k * dim + d];
            steps[k * dim + d] += step;
            steps[(k + 1) * dim + d] -= step;
        }
    }
    double farthest = 0.0;
    for (Index k = 0; k < count; ++k) {
        double squares = 0.0;
        for (Index d = 0; d < dim; ++d) squares += steps[k * dim + d] * steps[k * dim + d];
        farthest = most(farthest, std::sqrt(squares));
    }
    const double share = farthest > length ? length / farthest : 1.0;
    for (std::size_t i = 0; i < joints.size(); ++i) joints[i] += share * steps[i];
}

// Newton's method, of which every step moves all joints together; what it leaves is scaled away along the segments, about the mean.
auto exact_lengths(Matrix<double> joints, double length, Index rounds, double tolerance) {
    const Index count = joints.shape(0), dim = joints.shape(1);
    ReleasedGil released;
    std::vector<double> moved(joints.data(), joints.data() + count * dim);
    for (Index round = 0; round < rounds; ++round) {
        count_visits(count);
        const Segments segments(moved, count, dim, length);
        if (segments.worst() < tolerance * length) break;
        move(moved, segments, count, dim, length);
    }
    const Segments segments(moved, count, dim, length);
    std::vector<double> exact = moved;
    for (Index i = dim; i < count * dim; ++i) exact[i] = exact[i - dim] + length * segments.directions[i - dim];
    for (Index d = 0; d < dim; ++d) {
        double shift = 0.0;
        for (Index k = 0; k < count; ++k) shift += moved[k * dim + d] - exact[k * dim + d];
        for (Index k = 0; k < count; ++k) exact[k * dim + d] += shift / double(count);
    }
    released.end();
    return to_numpy(std::move(exact), count, dim);
}

}  // namespace

void bind_segment_lengths(Module& m) {
    // Return joints moved so that neighbors are about `length` apart (Mueller et al., "Position based dynamics", 2007).
    //
    // Parameters
    // ----------
    // joints
    //     (J, D) float64, m
    // length
    //     distance that neighbors are to have, m
    // mobility
    //     (J,) float64, how far each joint gives way, relative to the others; 0 for a joint that stays
    // rounds
    //     times at most that all segments are brought to their length
    // tolerance
    //     share of `length` by which the worst segment may differ from it
    //
    // Returns
    // -------
    // (J, D) float64, m.
    m.def("equalize_lengths", &equalize_lengths, "joints"_a.noconvert(), "length"_a, "mobility"_a.noconvert(), "rounds"_a,
          "tolerance"_a);

    // Return joints moved until neighbors are exactly `length` apart.
    //
    // Each step of Newton's method is the least, in the sum of squares, that makes them so to first order.
    //
    // Parameters
    // ----------
    // joints
    //     (J, D) float64, m
    // length
    //     distance that neighbors are to have, m
    // rounds
    //     steps of Newton's method at most
    // tolerance
    //     share of `length` by which the worst segment may differ from it before all are scaled to it, in their directions
    //
    // Returns
    // -------
    // (J, D) float64, m.
    m.def("exact_lengths", &exact_lengths, "joints"_a.noconvert(), "length"_a, "rounds"_a, "tolerance"_a);
}
