#include <algorithm>
#include <array>
#include <limits>

#include "arrays.h"

namespace {

// Where a strand is cut, and how many places farther along, or less far, its next part lies than it would uncut.
struct Cut {
    Index before;
    double skipped;  // infinite if it lies in the other direction
};

// A state is where a strand would begin on the object, or end where it runs against it. Each point costs the squared distance from its
// place in that state, in squared standard deviations, at most that of a point beside the object; a change of state before a point costs
// its `cut`. The cheapest sequence of states is found by dynamic programming (Viterbi): after each point only the cheapest state needs
// to be remembered, since all changes there cost the same (Potts model). The object may have moved on as a whole: so where there
// are cuts, this is done once more, with the strand moved to where it lies best uncut.
class Cuts {
public:
    Cuts(const Matrix<double>& points, const Vector<double>& arcs, const Matrix<double>& places, const Vector<double>& cut, Index whole,
         double step, double deviation, double outside, double shift)
        : points_(points), places_(places.data()), cut_(cut), count_(points.shape(0)), size_(places.shape(0)), whole_(whole),
          starts_(size_ + whole), variance_(deviation * deviation), outside_(outside), shift_(shift) {
        for (Index k = 0; k < count_; ++k) along_.push_back(std::min(std::max<Index>(std::lround(arcs(k) / step), 0), whole));
    }
    std::vector<Cut> cheapest() const {
        double still = 0.0, total = 0.0, squares = 0.0;
        std::vector<Cut> cuts = cut_moved({}, still);
        if (cuts.empty()) return cuts;
        const std::array<double, 3> moved = displacement();
        for (const double value : moved) squares += value * value;
        std::vector<Cut> others = cut_moved(moved, total);
        return total + double(count_) * squares / (shift_ * shift_ * variance_) < still ? others : cuts;
    }

private:
    const Matrix<double>& points_;
    const double* places_;
    const Vector<double>& cut_;
    Index count_, size_, whole_, starts_;
    double variance_, outside_, shift_;
    std::vector<Index> along_;

    // Return the index of the place of a point in a state; beyond an end, that end.
    Index place_of(Index state, Index k) const {
        const Index at = state < starts_ ? state - whole_ + along_[k] : state - starts_ - along_[k];
        return std::min(std::max<Index>(at, 0), size_ - 1);
    }
    // Return how far the strand lies on the mean from the object where it fits best uncut, if a displacement counts little.
    std::array<double, 3> displacement() const {
        std::array<double, 3> best{};
        double least = std::numeric_limits<double>::infinity();
        count_visits(count_ * 2 * starts_);
        for (Index state = 0; state < 2 * starts_; ++state) {
            std::array<double, 3> mean{};
            double squares = 0.0, shift = 0.0;
            for (Index k = 0; k < count_; ++k) {
                const double *p = points_.data() + 3 * k, *place = places_ + 3 * place_of(state, k);
                for (Index d = 0; d < 3; ++d) {
                    mean[d] += (p[d] - place[d]) / double(count_);
                    squares += (p[d] - place[d]) * (p[d] - place[d]) / double(count_);
                }
            }
            for (const double value : mean) shift += value * value;
            const double cost = squares - shift + shift / (shift_ * shift_);
            if (cost < least) {
                least = cost;
                best = mean;
            }
        }
        return best;
    }
    // Return the cheapest cuts of the strand moved back by a displacement, and what they cost.
    std::vector<Cut> cut_moved(const std::array<double, 3>& moved, double& cost) const {
        const Index states = 2 * starts_, beside = whole_;
        std::vector<double> costs(size_ + 2 * beside), total(states, 0.0);  // of each place, and of the ends so far beyond them
        std::vector<std::uint8_t> changed(count_ * states, 0);
        std::vector<Index> best(count_, 0);
        std::vector<Cut> cuts;
        for (Index k = 0; k < count_; ++k) {
            const double* p = points_.data() + 3 * k;
            for (Index q = 0; q < size_; ++q) {
                double squares = 0.0;
                for (Index d = 0; d < 3; ++d) {
                    const double off = p[d] - moved[d] - places_[3 * q + d];
                    squares += off * off;
                }
                costs[beside + q] = std::min(squares / variance_, outside_);
            }
            std::fill_n(costs.begin(), beside, costs[beside]);
            std::fill_n(costs.end() - beside, beside, costs[beside + size_ - 1]);
            best[k] = k ? std::min_element(total.begin(), total.end()) - total.begin() : 0;
            const double limit = k ? total[best[k]] + cut_(k) : 0.0;
            for (const bool backwards : {false, true}) {
                const Index first = backwards ? starts_ : 0;
                const double* cost = costs.data() + beside + (backwards ? -along_[k] : along_[k] - whole_);
                std::uint8_t* jumped = changed.data() + k * states + first;
                double* sums = total.data() + first;
                for (Index s = 0; s < starts_; ++s) {
                    jumped[s] = sums[s] > limit;
                    sums[s] = std::min(sums[s], limit) + cost[s];
                }
            }
        }
        count_visits(count_ * (size_ + states));
        Index state = std::min_element(total.begin(), total.end()) - total.begin();
        cost = total[state];
        for (Index k = count_ - 1; k > 0; --k) {
            if (!changed[k * states + state]) continue;
            const bool goes_on = (state < starts_) == (best[k] < starts_);
            cuts.push_back({k, goes_on ? double(std::abs(state - best[k])) : std::numeric_limits<double>::infinity()});
            state = best[k];
        }
        std::reverse(cuts.begin(), cuts.end());
        return cuts;
    }
};

auto strand_cuts(Matrix<double> points, Vector<double> arcs, double length, Matrix<double> places, double step, double deviation,
               double outside, double shift, Vector<double> cut) {
    const Index count = points.shape(0), size = places.shape(0);
    require(points.shape(1) == 3 && places.shape(1) == 3, "points and places are not 3-D");
    require(Index(arcs.shape(0)) == count, "arcs is not one value per point");
    require(Index(cut.shape(0)) == count, "cut is not one value per point");
    require(step > 0 && deviation > 0 && shift > 0, "step, deviation and shift are not positive");
    ReleasedGil released;
    std::vector<Cut> cuts;
    if (count && size) cuts = Cuts(points, arcs, places, cut, std::lround(length / step), step, deviation, outside, shift).cheapest();
    std::vector<Index> before;
    std::vector<double> skipped;
    for (const Cut& each : cuts) {
        before.push_back(each.before);
        skipped.push_back(each.skipped * step);
    }
    released.end();
    return std::make_pair(to_numpy(std::move(before)), to_numpy(std::move(skipped)));
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
    //     largest cost of a point, in squared standard deviations; one beyond an end of the object is compared with that end
    // shift
    //     how much less a displacement of the whole strand counts than one of a point, as a factor of the standard deviation
    // cut
    //     (N,) float64, cost of a cut before each point, in squared standard deviations
    //
    // Returns
    // -------
    // before : (K,) int64, indices of points, ascending; empty if the strand is best left whole. skipped : (K,) float64 m, how much
    // farther along the object, or less far, the next part lies than it would uncut; infinite if it runs in the other direction.
    m.def("strand_cuts", &strand_cuts, "points"_a.noconvert(), "arcs"_a.noconvert(), "length"_a, "places"_a.noconvert(), "step"_a,
          "deviation"_a, "outside"_a, "shift"_a, "cut"_a.noconvert());
}
