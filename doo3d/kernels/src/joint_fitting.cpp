// Joints of an object fitted to the strands placed along it, by regularized least squares, with segments of one length.
#include "arrays.h"
#include "polyline.h"

#include <algorithm>
#include <array>
#include <initializer_list>

namespace {

constexpr Index REACH = 8;  // entries beside the diagonal of the normal equations: those of two more joints

struct Samples {
    std::vector<double> points, sights, arcs;
    std::vector<Index> strands;
    std::vector<bool> slides;

    Index count() const { return Index(arcs.size()); }
    bool is_measured(Index i) const { return sights[3 * i] == 0 && sights[3 * i + 1] == 0 && sights[3 * i + 2] == 0; }
    bool is_sliding(Index i) const { return slides[strands[i]]; }
};

struct Weights {
    double turn, place, slide, length;
};

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The lower half of the normal equations, row by row with the diagonal last, and their right side, three coordinates a joint.
struct Equations {
    std::vector<std::array<double, REACH + 1>> rows;
    std::vector<double> right;

    explicit Equations(Index joints) : rows(3 * joints), right(3 * joints) {}
    void add(Index i, Index j, double value) { rows[i][REACH - (i - j)] += value; }
    // Add the square of a difference of the displacements of joints from `first` on, of which `target` is missing.
    void add_difference(Index first, std::initializer_list<double> difference, double weight, const double* target) {
        const double* values = difference.begin();
        for (Index a = 0; a < Index(difference.size()); ++a) {
            for (Index d = 0; d < 3; ++d) {
                for (Index b = 0; b <= a; ++b) add(3 * (first + a) + d, 3 * (first + b) + d, weight * values[a] * values[b]);
                right[3 * (first + a) + d] += weight * values[a] * target[d];
            }
        }
    }
    // Add the square of what is missing along one direction.
    void add_along(Index first, std::initializer_list<double> difference, double weight, const double* along, double target) {
        const double* values = difference.begin();
        for (Index a = 0; a < 3 * Index(difference.size()); ++a) {
            const double value = weight * values[a / 3] * along[a % 3];
            for (Index b = 0; b <= a; ++b) add(3 * first + a, 3 * first + b, value * values[b / 3] * along[b % 3]);
            right[3 * first + a] += value * target;
        }
    }
    // Replace the right side by the solution, by Cholesky's factorization.
    void solve() {
        const Index count = Index(rows.size());
        for (Index i = 0; i < count; ++i) {
            for (Index k = std::max<Index>(i - REACH, 0); k <= i; ++k) {
                double& entry = rows[i][REACH - (i - k)];
                for (Index j = std::max<Index>(i - REACH, 0); j < k; ++j) entry -= rows[i][REACH - (i - j)] * rows[k][REACH - (k - j)];
                if (k < i) {
                    entry /= rows[k][REACH];
                    right[i] -= entry * right[k];
                } else {
                    require(entry > 0, "the weights are too few to determine the joints");
                    entry = std::sqrt(entry);
                    right[i] /= entry;
                }
            }
        }
        for (Index i = count - 1; i >= 0; --i) {
            for (Index k = i + 1; k <= std::min(i + REACH, count - 1); ++k) right[i] -= rows[k][REACH - (k - i)] * right[k];
            right[i] /= rows[i][REACH];
        }
    }
};

class Fit {
public:
    Fit(std::vector<double> expected, Samples samples, double segment, const Weights& weights)
        : joints(std::move(expected)), samples(std::move(samples)), segment_(segment), weights_(weights), count_(Index(joints.size()) / 3) {}

    std::vector<double> joints;
    Samples samples;

    void run(Index rounds, double tolerance) {
        Index measured = 0;
        for (Index i = 0; i < samples.count(); ++i) measured += samples.is_measured(i);
        if (measured) move(joints, false, false);
        if (measured < samples.count()) move(joints, true, false);
        even();
        const std::vector<double> base = joints;
        for (Index k = 0; k < rounds && worst_length() > tolerance * segment_; ++k) {
            move(base, true, true);
            slide();
        }
    }

private:
    struct Place {
        Index low;
        double part;
        const double *a, *b;
    };
    double segment_;
    Weights weights_;
    Index count_;

    Place place_of(Index i) const {
        const double at = std::min(std::max(samples.arcs[i] / segment_, 0.0), double(count_ - 1) - 1e-9);
        const Index low = Index(at);
        return {low, at - double(low), &joints[3 * low], &joints[3 * low] + 3};
    }
    // Return what a sample misses, and the direction of the object there.
    void offset(const Place& place, Index i, double* missing, double* along) const {
        for (Index d = 0; d < 3; ++d) {
            missing[d] = samples.points[3 * i + d] - (place.a[d] * (1 - place.part) + place.b[d] * place.part);
            along[d] = place.b[d] - place.a[d];
        }
        const double length = std::sqrt(dot(along, along));
        for (Index d = 0; d < 3; ++d) along[d] /= std::max(length, 1e-12);
    }
    // Move the joints once, from what is expected, to the samples, or to those only whose place is known.
    void move(const std::vector<double>& given, bool all, bool with_lengths) {
        const std::vector<double> expected = given;
        Equations equations(count_);
        count_visits(count_ + samples.count());
        for (Index i = 0; i < samples.count(); ++i) {
            if (!all && !samples.is_measured(i)) continue;
            const Place place = place_of(i);
            const double share[2] = {1 - place.part, place.part}, *sight = &samples.sights[3 * i];
            double missing[3], along[3];
            offset(place, i, missing, along);
            const double unknown = dot(missing, sight);
            for (Index d = 0; d < 3; ++d) missing[d] -= unknown * sight[d];
            equations.add_difference(place.low, {share[0], share[1]}, 1.0, missing);
            if (with_lengths && samples.is_sliding(i)) {
                equations.add_along(place.low, {share[0], share[1]}, weights_.slide - 1.0, along, dot(missing, along));
            }
        }
        for (Index i = 0; i < count_; ++i) {
            double off[3][3], turn[3], bend[3];
            for (Index k = 0; k < std::min<Index>(3, count_ - i); ++k) {
                for (Index d = 0; d < 3; ++d) off[k][d] = expected[3 * (i + k) + d] - joints[3 * (i + k) + d];
            }
            equations.add_difference(i, {1.0}, weights_.place, off[0]);
            if (i + 1 >= count_) break;
            for (Index d = 0; d < 3; ++d) turn[d] = off[1][d] - off[0][d];
            equations.add_difference(i, {-1.0, 1.0}, weights_.turn, turn);
            if (with_lengths) add_length(equations, i);
            if (i + 2 >= count_) continue;
            for (Index d = 0; d < 3; ++d) bend[d] = off[2][d] - 2 * off[1][d] + off[0][d];
            equations.add_difference(i, {1.0, -2.0, 1.0}, 1.0, bend);
        }
        equations.solve();
        double most = 0.0;
        for (const double value : equations.right) most = std::max(most, std::abs(value));
        const double share = with_lengths ? std::min(1.0, segment_ / std::max(most, 1e-12)) : 1.0;
        for (Index i = 0; i < 3 * count_; ++i) joints[i] += share * equations.right[i];
    }
    void add_length(Equations& equations, Index i) const {
        double along[3];
        for (Index d = 0; d < 3; ++d) along[d] = joints[3 * (i + 1) + d] - joints[3 * i + d];
        const double length = std::sqrt(dot(along, along));
        for (Index d = 0; d < 3; ++d) along[d] /= std::max(length, 1e-12);
        equations.add_along(i, {-1.0, 1.0}, weights_.length, along, segment_ - length);
    }
    double worst_length() const {
        double worst = 0.0;
        for (Index i = 0; i + 1 < count_; ++i) {
            worst = std::max(worst, std::abs(std::sqrt(squared_distance(&joints[3 * i], &joints[3 * i + 3], 3)) - segment_));
        }
        return worst;
    }
    // Space joints evenly where no sample is, along the same line.
    void even() {
        std::vector<bool> shown(count_, false);
        for (Index i = 0; i < samples.count(); ++i) {
            const Index k = Index(std::nearbyint(samples.arcs[i] / segment_));
            if (k >= 0 && k < count_) shown[k] = true;
        }
        for (Index first = 0, end = 0; first < count_; first = end) {
            end = first + 1;
            if (shown[first]) continue;
            while (end < count_ && !shown[end]) ++end;
            const Index low = std::max<Index>(first - 1, 0), high = std::min(end, count_ - 1);
            const std::vector<double> part(&joints[3 * low], &joints[3 * high] + 3), along = arc_lengths(part, 3);
            for (Index k = low + 1; k < high; ++k) {
                place_at([&](Index p, Index d) { return part[3 * p + d]; }, along, along.back() * double(k - low) / double(high - low), 3,
                         &joints[3 * k]);
            }
        }
    }
    // Slide strands along the object, each by what its samples miss along it.
    void slide() {
        std::vector<double> sums(samples.slides.size(), 0.0), counts(samples.slides.size(), 0.0);
        for (Index i = 0; i < samples.count(); ++i) {
            double missing[3], along[3];
            offset(place_of(i), i, missing, along);
            sums[samples.strands[i]] += dot(missing, along);
            counts[samples.strands[i]] += 1.0;
        }
        for (Index i = 0; i < samples.count(); ++i) {
            const double mean = sums[samples.strands[i]] / counts[samples.strands[i]];
            if (samples.is_sliding(i)) samples.arcs[i] += std::max(-segment_, std::min(segment_, mean));
        }
    }
};

auto fit_joints(StridedMatrix<double> expected, StridedMatrix<double> points, Vector<double> arcs, StridedMatrix<double> sights,
                Vector<Index> bounds, Vector<bool> slides, double segment, Vector<double> weights, Index rounds, double tolerance) {
    const Index count = expected.shape(0), number = points.shape(0);
    check_bounds(bounds, number);
    require(expected.shape(1) == 3 && points.shape(1) == 3 && sights.shape(1) == 3, "points do not have three coordinates");
    require(Index(arcs.shape(0)) == number && Index(sights.shape(0)) == number, "arcs or sights are not one per point");
    require(Index(bounds.shape(0)) == Index(slides.shape(0)) + 1, "slides are not one per strand");
    require(count >= 2 && segment > 0, "there are no segments, or they have no length");
    require(weights.shape(0) == 4, "weights are not four");
    ReleasedGil released;
    Samples samples{dense(points), dense(sights), {}, {}, {}};
    for (Index c = 0; c < Index(slides.shape(0)); ++c) {
        samples.slides.push_back(slides(c));
        for (Index i = bounds(c); i < bounds(c + 1); ++i) {
            require(std::isfinite(arcs(i)), "an arc length is not finite");
            samples.arcs.push_back(arcs(i));
            samples.strands.push_back(c);
        }
    }
    Fit fit(dense(expected), std::move(samples), segment, {weights(0), weights(1), weights(2), weights(3)});
    if (number) fit.run(rounds, tolerance);
    released.end();
    return std::make_tuple(to_numpy(std::move(fit.joints), count, 3), to_numpy(std::move(fit.samples.arcs)));
}

}  // namespace

void bind_joint_fitting(Module& m) {
    // Return the joints of an object fitted to samples of strands, by regularized least squares, and where the samples lie then.
    //
    // The displacements d of the expected joints minimize the squared distances of the samples from the object, plus |d''|^2,
    // turn |d'|^2 and place |d|^2, with differences of neighbors for derivatives: first with the samples whose place is known, then
    // with all. Of the others the offset along the sight does not count. Then the joints that no sample is near are spaced evenly,
    // and from there the same sum plus the squared errors of all lengths is made least (Gauss-Newton). There, strands that may slide
    // lie anywhere along the object, but for a small weight; where, is found from what their samples miss along it after each round.
    //
    // Parameters
    // ----------
    // expected
    //     (J, 3) float64 m, J >= 2
    // points, arcs
    //     (N, 3) and (N,) float64 m, the samples, and the arc length of the object at each; those beyond an end count there
    // sights
    //     (N, 3) float64 unit, direction in which the place of a sample is not known; 0 where it is known
    // bounds
    //     (S + 1,) int64, the index of the first sample of each strand, and N
    // slides
    //     (S,) bool, which strands may slide along the object
    // segment
    //     distance of neighboring joints, m
    // weights
    //     (4,) float64, beside 1 for a sample and for second differences: turn, place, offsets along the object of strands that
    //     slide, and errors of lengths
    // rounds, tolerance
    //     most rounds with lengths, and the share of its length by which a segment may miss it
    //
    // Returns
    // -------
    // joints
    //     (J, 3) float64 m; those expected if there are no samples
    // arcs
    //     (N,) float64 m, arc length of the object at each sample
    //
    // A ValueError says if the weights do not determine the joints.
    m.def("fit_joints", &fit_joints, "expected"_a.noconvert(), "points"_a.noconvert(), "arcs"_a.noconvert(), "sights"_a.noconvert(),
          "bounds"_a.noconvert(), "slides"_a.noconvert(), "segment"_a, "weights"_a.noconvert(), "rounds"_a, "tolerance"_a);
}
