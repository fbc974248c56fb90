#include "arrays.h"

namespace {

double distance(const double* a, const double* b, Index dim) { return std::sqrt(squared_distance(a, b, dim)); }

// Return the cosine of the angle between a -> b and c -> d.
double cosine(const double* a, const double* b, const double* c, const double* d, Index dim) {
    double dot = 0.0;
    for (Index k = 0; k < dim; ++k) dot += (b[k] - a[k]) * (d[k] - c[k]);
    return dot / (distance(a, b, dim) * distance(c, d, dim));
}

// Return the polyline with points added so that no step is longer than `length`; a ring runs back to its first point.
std::vector<double> divided(const double* points, Index count, Index dim, bool closed, double length) {
    std::vector<double> line(points, points + dim);
    for (Index i = 0; i + 1 < count + closed; ++i) {
        const double *from = points + i * dim, *to = points + (i + 1) % count * dim;
        const Index parts = std::max<Index>(1, Index(std::ceil(distance(from, to, dim) / length)));
        for (Index k = 1; k < parts; ++k) {
            const double at = double(i) + double(k) / double(parts) - double(i);
            for (Index d = 0; d < dim; ++d) line.push_back((to[d] - from[d]) * at + from[d]);
        }
        line.insert(line.end(), to, to + dim);
    }
    count_visits(Index(line.size()) / dim);
    return line;
}

// The joints of all chains, and the row of the first of each.
struct Chains {
    std::vector<double> joints;
    std::vector<Index> bounds{0};
    std::vector<Byte> closed;
};

// The names are the paper's: p_s start of the current segment, p_c point being traversed, p_e its end, p_t the
// tip: the farthest point from p_s so far, from which a new chain starts after a sharp turn.
void traverse_contour(const std::vector<double>& points, Index dim, double length, double min_cosine, Chains& chains) {
    std::vector<double> p_s(points.data(), points.data() + dim), p_t(p_s), p_e(dim);
    bool update_tip = true;
    Index size = chains.bounds.back();
    const auto add = [&](const std::vector<double>& joint) {
        chains.joints.insert(chains.joints.end(), joint.begin(), joint.end());
        ++size;
    };
    for (Index i = 0; i < Index(points.size()) / dim; ++i) {
        const double* p_c = points.data() + i * dim;
        const double away = distance(p_c, p_s.data(), dim);
        if (away >= length) {
            for (Index d = 0; d < dim; ++d) p_e[d] = p_s[d] + (p_c[d] - p_s[d]) * length / away;
            const bool first = size == chains.bounds.back();
            const double* end = chains.joints.data() + chains.joints.size();
            if (first || cosine(end - 2 * dim, end - dim, p_s.data(), p_e.data(), dim) >= min_cosine) {
                if (first) add(p_s);
                add(p_e);
                p_s = p_t = p_e;
            } else {
                chains.bounds.push_back(size);
                p_s = p_t;
            }
            update_tip = true;
        } else if (away >= distance(p_t.data(), p_s.data(), dim)) {
            if (update_tip) p_t.assign(p_c, p_c + dim);
        } else {
            update_tip = false;
        }
    }
    if (size > chains.bounds.back()) chains.bounds.push_back(size);
}

auto fit_chains(Matrix<double> points, Vector<Index> bounds, Vector<bool> closed, double length, double min_cosine) {
    const Index dim = points.shape(1), lines = Index(closed.shape(0));
    check_bounds(bounds, points.shape(0));
    require(Index(bounds.shape(0)) == lines + 1, "bounds and closed do not fit each other");
    require(dim > 0 && length > 0, "points have no coordinates, or length is not positive");
    double total = 0.0;
    for (Index c = 0; c < lines; ++c) {
        for (Index i = bounds(c); i < bounds(c + 1); ++i) {
            for (Index d = 0; d < dim; ++d) require(std::isfinite(points(i, d)), "a coordinate is not finite");
            total += distance(&points(i, 0), &points(i > bounds(c) ? i - 1 : bounds(c + 1) - 1, 0), dim);
        }
    }
    require(total / length < 1e8, "the points are over 1e8 times as long as a segment");
    Chains chains;
    for (Index c = 0; c < lines; ++c) {
        const Index count = bounds(c + 1) - bounds(c);
        if (count < 2) continue;
        const Index before = Index(chains.bounds.size());
        const double* first = points.data() + bounds(c) * dim;
        traverse_contour(divided(first, count, dim, closed(c), length), dim, length, min_cosine, chains);
        const Index laid = Index(chains.bounds.size()) - before;
        chains.closed.insert(chains.closed.end(), laid, closed(c) && laid == 1);
    }
    return std::make_tuple(rows_of(std::move(chains.joints), dim), std::move(chains.bounds),
                           flags(std::move(chains.closed)));
}

}  // namespace

void bind_segment_fitting(Module& m) {
    // Lay chains of segments of equal length along polylines; a sharp turn ends a chain.
    //
    // It is Algorithm 2 of Keipour et al. (RA-L 2022). After a sharp turn the next chain begins at the tip of the turn: the point
    // that was farthest from the end of the last segment. Points farther apart than a segment get points in between first.
    //
    // Parameters
    // ----------
    // points
    //     (P, D) float64, the points of L polylines, one polyline after the other
    // bounds
    //     (L + 1,) int64, row of the first point of each polyline; the last entry is P
    // closed
    //     (L,) bool, True for a ring, which is followed back to its first point
    // length
    //     length of a segment, in the unit of the points
    // min_cosine
    //     cosine of the greatest turn allowed between two segments of a chain
    //
    // Returns
    // -------
    // joints : (J, D) float64, the J joints of all C chains, one chain after the other
    // bounds : (C + 1,) int64, row of the first joint of each chain; the last entry is J. Each chain has at least two joints; there
    //     is none where the points do not reach over one segment
    // closed : (C,) bool, True for the only chain of a ring
    m.def("fit_chains", &fit_chains, "points"_array, "bounds"_array, "closed"_array, "length"_a, "min_cosine"_a);
}
