#include "arrays.h"
#include "vector3.h"

namespace {

// The step of the places, m; the standard deviation of a point, m, its largest cost and how much less a shift of all counts.
struct Rule {
    double step, deviation, outside, shift;
};

// Coordinates of the places of the object, one array each, with its ends repeated: a state begins anywhere from the length of the strand
// before the object to its end.
using Places = std::array<std::vector<double>, 3>;

// What a point costs at each place of the object.
WITH_AVX2 void place_costs(const Places& places, const double* point, double variance, double outside, double* __restrict costs) {
    const double *__restrict x = places[0].data(), *__restrict y = places[1].data(), *__restrict z = places[2].data();
    const Index size = Index(places[0].size());
    for (Index q = 0; q < size; ++q) {
        const double off_x = point[0] - x[q], off_y = point[1] - y[q], off_z = point[2] - z[q];
        const double squares = (off_x * off_x + off_y * off_y + off_z * off_z) / variance;
        costs[q] = squares < outside ? squares : outside;
    }
}

// Add what a point costs to each state, or to the cheapest change of state, and note which were changed.
WITH_AVX2 void advance(double* __restrict sums, Byte* __restrict changed, const double* __restrict costs, Index states, double limit) {
    for (Index s = 0; s < states; ++s) changed[s] = sums[s] > limit;
    for (Index s = 0; s < states; ++s) sums[s] = (sums[s] > limit ? limit : sums[s]) + costs[s];
}

// Sums over the points of a strand in each state: how far they lie from their places, and the squares of that.
struct Offsets {
    std::vector<double> x, y, z, squares;
};

// Add how far a point lies from its place in the states from `at` on, whose places are those from `first` on.
WITH_AVX2 void add_offsets(const Places& places, Index first, const double* point, Index states, Index at, Offsets& sums) {
    const double *__restrict x = places[0].data() + first, *__restrict y = places[1].data() + first, *__restrict z = places[2].data() + first;
    double *__restrict sum_x = &sums.x[at], *__restrict sum_y = &sums.y[at], *__restrict sum_z = &sums.z[at];
    double* __restrict squares = &sums.squares[at];
    for (Index s = 0; s < states; ++s) {
        const double off_x = point[0] - x[s], off_y = point[1] - y[s], off_z = point[2] - z[s];
        sum_x[s] += off_x;
        sum_y[s] += off_y;
        sum_z[s] += off_z;
        squares[s] += off_x * off_x + off_y * off_y + off_z * off_z;
    }
}

// Return the first of the least values.
WITH_AVX2 Index least_of(const std::vector<double>& values) {
    std::array<double, 8> least;
    least.fill(INFINITY);
    std::size_t k = 0;
    for (; k + least.size() <= values.size(); k += least.size()) {
        UNROLLED
        for (std::size_t lane = 0; lane < least.size(); ++lane) least[lane] = values[k + lane] < least[lane] ? values[k + lane] : least[lane];
    }
    double best = *std::min_element(least.begin(), least.end());
    for (; k < values.size(); ++k) best = std::min(best, values[k]);
    return std::find(values.begin(), values.end(), best) - values.begin();
}

// A state is where a strand would begin on the object, or end where it runs against it. Each point costs the squared distance from its
// place in that state, in squared standard deviations, at most that of a point beside the object; a change of state before a point costs
// its `cut`. The cheapest sequence of states is found by dynamic programming (Viterbi): after each point only the cheapest state needs
// to be remembered, since all changes there cost the same (Potts model). The object may have moved on as a whole: so where there
// are cuts, this is done once more, with the strand moved to where it lies best uncut. A strand that costs less uncut than any cut is
// left whole: where its middle lies nearest to the object, in one of both directions, mostly tells so.
class Cuts {
public:
    Cuts(const Matrix<double>& points, const Vector<double>& arcs, const Matrix<double>& places, const Vector<double>& cut, Index whole,
         const Rule& rule)
        : points_(points), places_(places.data()), cut_(cut), count_(points.shape(0)), size_(places.shape(0)), whole_(whole),
          starts_(size_ + whole), variance_(rule.deviation * rule.deviation), outside_(rule.outside), shift_(rule.shift) {
        for (Index k = 0; k < count_; ++k) along_.push_back(std::min(std::max<Index>(std::lround(arcs(k) / rule.step), 0), whole));
        for (Index d = 0; d < 3; ++d) {
            for (Index q = -whole; q < size_ + whole; ++q) repeated_[d].push_back(places_[3 * std::min(std::max<Index>(q, 0), size_ - 1) + d]);
        }
    }
    std::vector<Index> cheapest() const {
        double still = 0.0, total = 0.0;
        if (count_ < 2 || fits_uncut()) return {};
        std::vector<Index> cuts = cut_moved({}, still);
        if (cuts.empty()) return cuts;
        const Vec moved = displacement();
        std::vector<Index> others = cut_moved(moved, total);
        return total + double(count_) * dot(moved, moved) / (shift_ * shift_ * variance_) < still ? others : cuts;
    }

private:
    const Matrix<double>& points_;
    const double* places_;
    const Vector<double>& cut_;
    Index count_, size_, whole_, starts_;
    double variance_, outside_, shift_;
    std::vector<Index> along_;
    Places repeated_;

    // Return the index of the place of a point in a state; beyond an end, that end.
    Index place_of(Index state, Index k) const {
        const Index at = state < starts_ ? state - whole_ + along_[k] : state - starts_ - along_[k];
        return std::min(std::max<Index>(at, 0), size_ - 1);
    }
    // Return the index among the repeated places of that of a point in the first state of one direction; the others follow.
    Index first_place(Index k, bool backwards) const { return backwards ? whole_ - along_[k] : along_[k]; }
    // Return the squared distance of a point from a place.
    double squared_off(Index k, Index place) const {
        return squared_distance(points_.data() + 3 * k, places_ + 3 * place, 3);
    }
    // Tell whether the strand costs less than the cheapest cut, uncut and with its middle where the object is nearest.
    bool fits_uncut() const {
        const Index middle = count_ / 2;
        Index near = 0;
        double nearest = squared_off(middle, 0), least = INFINITY;
        for (Index q = 1; q < size_; ++q) {
            const double squares = squared_off(middle, q);
            if (squares < nearest) {
                nearest = squares;
                near = q;
            }
        }
        for (Index k = 1; k < count_; ++k) least = std::min(least, cut_(k));
        count_visits(size_ + 2 * count_);
        for (const Index state : {near + whole_ - along_[middle], starts_ + near + along_[middle]}) {
            double total = 0.0;
            for (Index k = 0; k < count_ && total < least; ++k) {
                total += std::min(squared_off(k, place_of(state, k)) / variance_, outside_);
            }
            if (total < least) return true;
        }
        return false;
    }
    // Return how far the strand lies on the mean from the object where it fits best uncut, if a displacement counts little.
    Vec displacement() const {
        const Index states = 2 * starts_;
        Offsets sums;
        for (auto* each : {&sums.x, &sums.y, &sums.z, &sums.squares}) each->resize(states);
        for (Index k = 0; k < 2 * count_; ++k) {
            const bool backwards = k % 2;
            add_offsets(repeated_, first_place(k / 2, backwards), points_.data() + 3 * (k / 2), starts_, backwards ? starts_ : 0, sums);
        }
        count_visits(count_ * states);
        Vec best{};
        double least = INFINITY;
        for (Index state = 0; state < states; ++state) {
            const Vec mean{sums.x[state] / double(count_), sums.y[state] / double(count_), sums.z[state] / double(count_)};
            const double shift = dot(mean, mean);
            const double cost = sums.squares[state] / double(count_) - shift + shift / (shift_ * shift_);
            if (cost < least) {
                least = cost;
                best = mean;
            }
        }
        return best;
    }
    // Return the cheapest cuts of the strand moved back by a displacement, and what they cost.
    std::vector<Index> cut_moved(const Vec& moved, double& cost) const {
        const Index states = 2 * starts_;
        std::vector<double> costs(repeated_[0].size()), total(states, 0.0);
        std::vector<Byte> changed(count_ * states, 0);
        std::vector<Index> best(count_, 0);
        std::vector<Index> cuts;
        for (Index k = 0; k < count_; ++k) {
            const double* p = points_.data() + 3 * k;
            const double point[3] = {p[0] - moved[0], p[1] - moved[1], p[2] - moved[2]};
            place_costs(repeated_, point, variance_, outside_, costs.data());
            best[k] = k ? least_of(total) : 0;
            const double limit = k ? total[best[k]] + cut_(k) : 0.0;
            for (const bool backwards : {false, true}) {
                const Index first = backwards ? starts_ : 0;
                const double* cost = costs.data() + first_place(k, backwards);
                advance(total.data() + first, changed.data() + k * states + first, cost, starts_, limit);
            }
        }
        count_visits(count_ * (size_ + states));
        Index state = least_of(total);
        cost = total[state];
        for (Index k = count_ - 1; k > 0; --k) {
            if (!changed[k * states + state]) continue;
            cuts.push_back(k);
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
    require(step > 0 && deviation > 0 && shift > 0 && outside > 0, "step, deviation, shift or outside is not positive");
    if (!count || !size) return std::vector<Index>();
    return Cuts(points, arcs, places, cut, std::lround(length / step), {step, deviation, outside, shift}).cheapest();
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
    // (K,) int64, indices of points, ascending; empty if the strand is best left whole
    m.def("strand_cuts", &strand_cuts, "points"_array, "arcs"_array, "length"_a, "places"_array, "step"_a, "deviation"_a, "outside"_a,
          "shift"_a, "cut"_array);
}
