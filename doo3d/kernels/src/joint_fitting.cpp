// Joints of an object fitted to the strands placed along it, by regularized least squares.
#include "arrays.h"
#include "polyline.h"

#include <algorithm>
#include <array>
#include <initializer_list>

namespace {

constexpr Index REACH = 2;  // entries beside the diagonal of the normal equations

struct Samples {
    std::vector<double> points, sights;
    const Vector<double>& arcs;
    bool is_measured(Index i) const { return sights[3 * i] == 0 && sights[3 * i + 1] == 0 && sights[3 * i + 2] == 0; }
};

// The lower half of the normal equations, row by row with the diagonal last, and their right side.
struct Equations {
    std::vector<std::array<double, REACH + 1>> rows;
    std::vector<std::array<double, 3>> right;

    explicit Equations(Index count) : rows(count), right(count) {}
    void add_squared_difference(Index first, std::initializer_list<double> difference, double weight) {
        const double* values = difference.begin();
        for (Index a = 0; a < Index(difference.size()); ++a) {
            for (Index b = 0; b <= a; ++b) rows[first + a][REACH - (a - b)] += weight * values[a] * values[b];
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
                    for (Index d = 0; d < 3; ++d) right[i][d] -= entry * right[k][d];
                } else {
                    require(entry > 0, "the weights are too few to determine the joints");
                    entry = std::sqrt(entry);
                    for (Index d = 0; d < 3; ++d) right[i][d] /= entry;
                }
            }
        }
        for (Index i = count - 1; i >= 0; --i) {
            for (Index d = 0; d < 3; ++d) {
                for (Index k = i + 1; k <= std::min(i + REACH, count - 1); ++k) right[i][d] -= rows[k][REACH - (k - i)] * right[k][d];
                right[i][d] /= rows[i][REACH];
            }
        }
    }
};

// Move joints to the samples, or to those only whose place is known.
void fit(std::vector<double>& joints, const Samples& samples, double segment, double turn, double place, bool all) {
    const Index count = Index(joints.size()) / 3, number = Index(samples.arcs.shape(0));
    Equations equations(count);
    bool is_alone = true;
    count_visits(count + number);
    for (Index i = 0; i < number; ++i) {
        if (!all && !samples.is_measured(i)) continue;
        is_alone = false;
        const double at = std::min(std::max(samples.arcs(i) / segment, 0.0), double(count - 1) - 1e-9);
        const Index low = Index(at);
        const double part = at - double(low), *sight = &samples.sights[3 * i], *a = &joints[3 * low], *b = a + 3;
        double residual[3], along = 0.0;
        for (Index d = 0; d < 3; ++d) {
            residual[d] = samples.points[3 * i + d] - (a[d] * (1 - part) + b[d] * part);
            along += residual[d] * sight[d];
        }
        equations.add_squared_difference(low, {1 - part, part}, 1.0);
        for (Index d = 0; d < 3; ++d) {
            equations.right[low][d] += (1 - part) * (residual[d] - along * sight[d]);
            equations.right[low + 1][d] += part * (residual[d] - along * sight[d]);
        }
    }
    if (is_alone) return;
    for (Index i = 0; i < count; ++i) {
        equations.add_squared_difference(i, {1.0}, place);
        if (i + 1 < count) equations.add_squared_difference(i, {-1.0, 1.0}, turn);
        if (i + 2 < count) equations.add_squared_difference(i, {1.0, -2.0, 1.0}, 1.0);
    }
    equations.solve();
    for (Index i = 0; i < count; ++i) {
        for (Index d = 0; d < 3; ++d) joints[3 * i + d] += equations.right[i][d];
    }
}

// Space joints evenly where no sample is, along the same line.
void even(std::vector<double>& joints, const Samples& samples, double segment) {
    const Index count = Index(joints.size()) / 3;
    std::vector<bool> shown(count, false);
    for (Index i = 0; i < Index(samples.arcs.shape(0)); ++i) {
        const Index k = Index(std::nearbyint(samples.arcs(i) / segment));
        if (k >= 0 && k < count) shown[k] = true;
    }
    for (Index first = 0, end = 0; first < count; first = end) {
        end = first + 1;
        if (shown[first]) continue;
        while (end < count && !shown[end]) ++end;
        const Index low = std::max<Index>(first - 1, 0), high = std::min(end, count - 1);
        const std::vector<double> part(&joints[3 * low], &joints[3 * high] + 3), along = arc_lengths(part, 3);
        for (Index k = low + 1; k < high; ++k) {
            place_at([&](Index p, Index d) { return part[3 * p + d]; }, along, along.back() * double(k - low) / double(high - low), 3,
                     &joints[3 * k]);
        }
    }
}

auto fit_joints(StridedMatrix<double> expected, StridedMatrix<double> points, Vector<double> arcs, StridedMatrix<double> sights,
                double segment, double turn, double place) {
    const Index count = expected.shape(0), number = points.shape(0);
    require(expected.shape(1) == 3 && points.shape(1) == 3 && sights.shape(1) == 3, "points do not have three coordinates");
    require(Index(arcs.shape(0)) == number && Index(sights.shape(0)) == number, "arcs or sights are not one per point");
    require(count >= 2 && segment > 0, "there are no segments, or they have no length");
    ReleasedGil released;
    for (Index i = 0; i < number; ++i) require(std::isfinite(arcs(i)), "an arc length is not finite");
    std::vector<double> joints = dense(expected);
    const Samples samples{dense(points), dense(sights), arcs};
    fit(joints, samples, segment, turn, place, false);
    bool is_measured = true;
    for (Index i = 0; i < number; ++i) is_measured = is_measured && samples.is_measured(i);
    if (!is_measured) fit(joints, samples, segment, turn, place, true);
    if (number) even(joints, samples, segment);
    released.end();
    return to_numpy(std::move(joints), count, 3);
}

}  // namespace

void bind_joint_fitting(Module& m) {
    // Return the joints of an object fitted to samples of strands, by regularized least squares.
    //
    // The displacements d of the expected joints minimize the squared distances of the samples from the object, plus |d''|^2,
    // turn |d'|^2 and place |d|^2, with differences of neighbors for derivatives: first with the samples whose place is known, then
    // with all. Of the others the offset along the sight does not count. Then the joints that no sample is near are spaced evenly.
    //
    // Parameters
    // ----------
    // expected
    //     (J, 3) float64 m, J >= 2
    // points, arcs
    //     (N, 3) and (N,) float64 m, the samples, and the arc length of the object at each; those beyond an end count there
    // sights
    //     (N, 3) float64 unit, direction in which the place of a sample is not known; 0 where it is known
    // segment
    //     distance of neighboring joints, m
    // turn, place
    //     weights, beside 1 for a sample and for second differences; of no samples, the joints are the expected ones
    //
    // Returns
    // -------
    // (J, 3) float64 m. A ValueError says if the weights do not determine it.
    m.def("fit_joints", &fit_joints, "expected"_a.noconvert(), "points"_a.noconvert(), "arcs"_a.noconvert(), "sights"_a.noconvert(),
          "segment"_a, "turn"_a, "place"_a);
}
