// Chains of segments along ordered points: the paper's Algorithm 2 (Keipour et al.).
#include "arrays.h"

namespace {

double distance(const double* a, const double* b, Index dim) { return std::sqrt(squared_distance(a, b, dim)); }

// Return the cosine of the angle between a -> b and c -> d.
double cosine(const double* a, const double* b, const double* c, const double* d, Index dim) {
    double dot = 0.0;
    for (Index k = 0; k < dim; ++k) dot += (b[k] - a[k]) * (d[k] - c[k]);
    return dot / (distance(a, b, dim) * distance(c, d, dim));
}

// The names are the paper's: p_s start of the current segment, p_c point being traversed, p_e its end, p_t the
// tip: the farthest point from p_s so far, from which a new chain starts after a sharp turn.
auto traverse_contour(StridedMatrix<double> contour, double length, double min_cosine) {
    const Index count = contour.shape(0), dim = contour.shape(1);
    const std::vector<double> points = finite_points(contour);
    require(length > 0, "length is not positive");
    std::vector<double> joints;
    std::vector<Index> bounds{0};
    std::vector<double> p_s(points.data(), points.data() + dim), p_t(p_s), p_e(dim);
    bool update_tip = true;
    Index size = 0;
    for (Index i = 0; i < count; ++i) {
        const double* p_c = points.data() + i * dim;
        const double away = distance(p_c, p_s.data(), dim);
        if (away >= length) {
            for (Index d = 0; d < dim; ++d) p_e[d] = p_s[d] + (p_c[d] - p_s[d]) * length / away;
            const bool first = size == bounds.back();
            const double* end = joints.data() + joints.size();
            if (first || cosine(end - 2 * dim, end - dim, p_s.data(), p_e.data(), dim) >= min_cosine) {
                if (first) {
                    joints.insert(joints.end(), p_s.begin(), p_s.end());
                    ++size;
                }
                joints.insert(joints.end(), p_e.begin(), p_e.end());
                ++size;
                p_s = p_t = p_e;
            } else {
                bounds.push_back(size);
                p_s = p_t;
            }
            update_tip = true;
        } else if (away >= distance(p_t.data(), p_s.data(), dim)) {
            if (update_tip) p_t.assign(p_c, p_c + dim);
        } else {
            update_tip = false;
        }
    }
    if (size > bounds.back()) bounds.push_back(size);
    return std::make_tuple(to_numpy(std::move(joints), size, dim), to_numpy(std::move(bounds)));
}

}  // namespace

void bind_segment_fitting(nb::module_& m) {
    m.def("traverse_contour", &traverse_contour, "points"_a.noconvert(), "length"_a, "min_cosine"_a);
}
