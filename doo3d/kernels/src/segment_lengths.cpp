#include "arrays.h"

namespace {

// Every segment in turn moves its two joints towards or from each other, each by its share of the mobility. Even segments come
// first, then odd ones, so that no joint is moved by two neighbors in a row and neither end of the chain is preferred.
auto equalize_lengths(Matrix<double> joints, double length, Vector<double> mobility, Index rounds, double tolerance) {
    const Index count = joints.shape(0), dim = joints.shape(1);
    require(Index(mobility.shape(0)) == count, "mobility is not one value per joint");
    ReleasedGil released;
    std::vector<double> moved(joints.data(), joints.data() + count * dim);
    for (Index round = 0; round < rounds; ++round) {
        double worst = 0.0;
        count_visits(count);
        for (Index first = 0; first < 2; ++first) {
            for (Index k = first; k + 1 < count; k += 2) {
                double *a = moved.data() + k * dim, *b = a + dim, square = 0.0;
                for (Index d = 0; d < dim; ++d) square += (b[d] - a[d]) * (b[d] - a[d]);
                const double distance = std::sqrt(square), share = mobility(k) + mobility(k + 1);
                worst = most(worst, std::abs(distance - length));
                if (!(distance > 0) || !(share > 0)) continue;
                const double scale = (distance - length) / distance / share;
                for (Index d = 0; d < dim; ++d) {
                    const double step = (b[d] - a[d]) * scale;
                    a[d] += mobility(k) * step;
                    b[d] -= mobility(k + 1) * step;
                }
            }
        }
        if (worst < tolerance * length) break;
    }
    released.end();
    return to_numpy(std::move(moved), count, dim);
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
}
