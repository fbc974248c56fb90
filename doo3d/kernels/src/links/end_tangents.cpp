#include "arrays.h"

namespace {

// A parabola over arc length, fitted by least squares to the joints near an end (a line, for fewer than four joints).
//
// The fit is in polynomials orthogonal over the joints, which needs no system of equations: with t the arc length, 0 at the end and
// negative along the chain, they are 1, t less its mean, and the square of that less its projections on the former two.
class EndFit {
public:
    EndFit(const double* joints, Index dim, Index last, Index inward) : joints_(joints), dim_(dim), last_(last), inward_(inward) {}

    // Take the joints within `window` of the end, at least two.
    void take(Index size, double window) {
        t_.assign(1, 0.0);
        double sum = 0.0;
        for (Index count = 1; count < size; ++count) {
            const double length = std::sqrt(squared_distance(joint(count), joint(count - 1), dim_)) - t_[count - 1];
            if (count > 1 && length > most(window, -t_[1]) * (1 + 1e-9)) break;
            t_.push_back(-length);
            sum -= length;
        }
        mean_ = sum / double(t_.size());
        count_visits(Index(t_.size()));
    }

    // Fill in the derivative at the end, (D,).
    void fit(double* first) {
        const double count = double(t_.size());
        double moment2 = 0.0, moment3 = 0.0, quadratic = 0.0;
        for (double& t : t_) {
            t -= mean_;
            moment2 += t * t;
            moment3 += t * (t * t);
        }
        for (const double t : t_) {
            const double q = t * t - moment2 / count - moment3 / moment2 * t;
            quadratic += q * q;
        }
        for (Index d = 0; d < dim_; ++d) {
            first[d] = 0.0;
            double second = 0.0;
            for (std::size_t i = 0; i < t_.size(); ++i) {
                const double offset = joint(i)[d] - joint(0)[d];
                first[d] += t_[i] * offset / moment2;
                if (t_.size() > 3) {
                    second += (t_[i] * t_[i] - moment2 / count - moment3 / moment2 * t_[i]) * offset / quadratic;
                }
            }
            first[d] -= second * (2 * mean_ + moment3 / moment2);
        }
    }

private:
    const double* joint(Index i) const { return joints_ + (last_ + inward_ * i) * dim_; }

    const double* joints_;
    Index dim_, last_, inward_;
    std::vector<double> t_;
    double mean_ = 0.0;
};

auto end_tangents(Matrix<double> joints, Vector<Index> bounds, double window) {
    const Index dim = joints.shape(1), chains = Index(bounds.shape(0)) - 1;
    require(dim > 0, "joints have no coordinates");
    require(chains >= 0, "bounds are empty, expected one more than chains");
    require(bounds(0) >= 0 && bounds(chains) <= Index(joints.shape(0)), "bounds go beyond the joints");
    for (Index c = 0; c < chains; ++c) require(bounds(c + 1) - bounds(c) >= 2, "a chain has fewer than two joints");
    std::vector<double> tangents(2 * chains * dim);
    for (Index end = 0; end < 2 * chains; ++end) {
        const Index begin = bounds(end / 2), stop = bounds(end / 2 + 1);
        EndFit parabola(joints.data(), dim, end % 2 == 0 ? begin : stop - 1, end % 2 == 0 ? 1 : -1);
        parabola.take(stop - begin, window);
        double* tangent = tangents.data() + end * dim;
        parabola.fit(tangent);
        double norm = 0.0;
        for (Index d = 0; d < dim; ++d) norm += tangent[d] * tangent[d];
        for (Index d = 0; d < dim && norm > 0; ++d) tangent[d] /= std::sqrt(norm);
    }
    return rows_of(std::move(tangents), dim);
}

}  // namespace

void bind_end_tangents(Module& m) {
    // Return the outward tangent at both ends of every chain.
    //
    // Parameters
    // ----------
    // joints
    //     (J, D) float64, the joints of all C chains, one chain after the other; each chain has at least two
    // bounds
    //     (C + 1,) int64; chain c is joints[bounds[c]:bounds[c + 1]], the last entry is J
    // window
    //     length of chain at each end that is fitted, in the unit of the joints
    //
    // Returns
    // -------
    // (2 C, D) float64 unit vectors out of the chain; rows 2 c and 2 c + 1 are the first and the last end of chain c
    //
    // Notes
    // -----
    // They are the tangents of a parabola over arc length, fitted by least squares to the joints within `window` of the end; with
    // fewer than four joints of a straight one. A line fitted over a length of a curve of radius R would lag behind its end by
    // length / 2R. The fit uses polynomials orthogonal over the joints, which needs no system of equations.
    m.def("end_tangents", &end_tangents, "joints"_array, "bounds"_array, "window"_a);
}
