#include <algorithm>

#include "arrays.h"

namespace {

// A state is where a strand would begin on the object, or end where it runs against it. Each point costs the squared distance from its
// place in that state, in squared standard deviations, at most that of a point beside the object; a change of state costs `cut`. The
// cheapest sequence of states is found by dynamic programming (Viterbi): after each point only the cheapest state needs to be
// remembered, since all changes cost the same (Potts model).
auto strand_cuts(Matrix<double> points, Vector<double> arcs, double length, Matrix<double> places, double step, double deviation,
               double outside, double cut) {
    const Index count = points.shape(0), size = places.shape(0);
    require(points.shape(1) == 3 && places.shape(1) == 3, "points and places are not 3-D");
    require(Index(arcs.shape(0)) == count, "arcs is not one value per point");
    require(step > 0 && deviation > 0, "step and deviation are not positive");
    ReleasedGil released;
    std::vector<Index> cuts;
    if (count && size) {
        const Index whole = std::lround(length / step), starts = size + whole, states = 2 * starts;
        std::vector<double> costs(size), total(states, 0.0);
        std::vector<std::uint8_t> changed(count * states, 0);
        std::vector<Index> cheapest(count, 0);
        const double* place = places.data();
        for (Index k = 0; k < count; ++k) {
            const double* p = points.data() + 3 * k;
            for (Index q = 0; q < size; ++q) {
                const double x = p[0] - place[3 * q], y = p[1] - place[3 * q + 1], z = p[2] - place[3 * q + 2];
                costs[q] = std::min((x * x + y * y + z * z) / (deviation * deviation), outside);
            }
            const Index best = k ? std::min_element(total.begin(), total.end()) - total.begin() : 0;
            const double limit = k ? total[best] + cut : 0.0;
            const Index along = std::lround(arcs(k) / step);
            std::uint8_t* jumped = changed.data() + k * states;
            cheapest[k] = best;
            for (Index s = 0; s < states; ++s) {
                const Index at = s < starts ? s - whole + along : s - starts - along;
                jumped[s] = total[s] > limit;
                total[s] = std::min(total[s], limit) + (at >= 0 && at < size ? costs[at] : outside);
            }
        }
        count_visits(count * (size + states));
        Index state = std::min_element(total.begin(), total.end()) - total.begin();
        for (Index k = count - 1; k > 0; --k) {
            if (!changed[k * states + state]) continue;
            cuts.push_back(k);
            state = cheapest[k];
        }
        std::reverse(cuts.begin(), cuts.end());
    }
    released.end();
    return to_numpy(std::move(cuts));
}

}  // namespace

void bind_strand_cuts(Module& m) {
    // Return the points before which a strand has to be cut, so that its parts lie along an object.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64, m, on the strand, in order
    // arcs
    //     (N,) float64, m, arc length of each point from the start of the strand
    // length
    //     arc length of the strand, m
    // places
    //     (P, 3) float64, m, evenly spaced along the object
    // step
    //     arc length of the object between neighboring places, m
    // deviation
    //     standard deviation of a point, m
    // outside
    //     largest cost of a point, and that of a point beyond the ends of the object, in squared standard deviations
    // cut
    //     cost of a cut, in squared standard deviations
    //
    // Returns
    // -------
    // (K,) int64, indices of points, ascending; empty if the strand is best left whole.
    m.def("strand_cuts", &strand_cuts, "points"_a.noconvert(), "arcs"_a.noconvert(), "length"_a, "places"_a.noconvert(), "step"_a,
          "deviation"_a, "outside"_a, "cut"_a);
}
