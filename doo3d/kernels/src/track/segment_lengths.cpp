#include "arrays.h"

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
    return shaped(std::move(moved), count, dim);
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
    m.def("equalize_lengths", &equalize_lengths, "joints"_array, "length"_a, "mobility"_array, "rounds"_a, "tolerance"_a);
}
