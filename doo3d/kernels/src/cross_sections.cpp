// Surface points in the cross-sections of samples along center lines, and what is pooled from them.
#include "arrays.h"
#include "medians.h"
#include "pooling.h"

namespace {

auto window_sum(Vector<double> values, Vector<Index> path, Index half) {
    require(values.shape(0) == path.shape(0), "values and path have different lengths");
    require(half >= 0, "half is negative");
    std::vector<double> dense(values.shape(0));
    for (std::size_t s = 0; s < dense.size(); ++s) dense[s] = values(s);
    return to_numpy(pooled(dense.data(), path, half));
}

auto section_offsets(Matrix<double> points, Vector<double> distance, Vector<Index> index, Matrix<double> positions,
                     Matrix<double> lateral, Matrix<double> depth, Vector<double> reach) {
    const Index count = points.shape(0), size = positions.shape(0);
    require(points.shape(1) == 3 && positions.shape(1) == 3, "points and positions are not (., 3)");
    require(lateral.shape(1) == 3 && depth.shape(1) == 3, "lateral and depth are not (., 3)");
    require(Index(distance.shape(0)) == count && Index(index.shape(0)) == count, "distance and index are not one per point");
    require(Index(lateral.shape(0)) == size && Index(depth.shape(0)) == size && Index(reach.shape(0)) == size,
            "lateral, depth and reach are not one per position");
    count_visits(count);
    std::vector<Index> sample;
    std::vector<double> across, behind;
    for (Index n = 0; n < count; ++n) {
        const Index s = index(n);
        require(s >= 0 && s < std::max<Index>(size, 1), "an index lies outside the positions");
        if (size == 0 || !(distance(n) < reach(s))) continue;
        double u = 0.0, w = 0.0;
        for (Index d = 0; d < 3; ++d) {
            const double offset = points(n, d) - positions(s, d);
            u += offset * lateral(s, d);
            w += offset * depth(s, d);
        }
        sample.push_back(s);
        across.push_back(u);
        behind.push_back(w);
    }
    return std::make_tuple(to_numpy(std::move(sample)), to_numpy(std::move(across)), to_numpy(std::move(behind)));
}

// The mean of w + sqrt(r^2 - u^2) over the points pooled at each sample: taken once over all, then without outliers.
auto axis_depth(Vector<Index> sample, Vector<double> lateral, Vector<double> depth, Vector<Index> path, Vector<double> radius,
                Index half, double central_part, double outlier_medians) {
    const Index count = sample.shape(0), size = path.shape(0);
    require(Index(lateral.shape(0)) == count && Index(depth.shape(0)) == count, "lateral and depth are not one per point");
    require(Index(radius.shape(0)) == size, "radius is not one per sample");
    require(half >= 0, "half is negative");
    count_visits(count);
    std::vector<Index> kept;
    std::vector<double> behind;
    for (Index k = 0; k < count; ++k) {
        const Index s = sample(k);
        require(s >= 0 && s < size, "an index lies outside the samples");
        if (!(std::fabs(lateral(k)) < central_part * radius(s))) continue;
        kept.push_back(s);
        behind.push_back(depth(k) + std::sqrt(radius(s) * radius(s) - lateral(k) * lateral(k)));
    }
    std::vector<double> counts, means;
    for (const bool last : {false, true}) {
        count_visits(Index(kept.size()));
        std::vector<double> number(size), total(size);
        for (std::size_t k = 0; k < kept.size(); ++k) {
            number[kept[k]] += 1;
            total[kept[k]] += behind[k];
        }
        counts = pooled(number.data(), path, half);
        means = pooled(total.data(), path, half);
        for (Index s = 0; s < size; ++s) means[s] /= std::max(counts[s], 1e-9);
        if (last || kept.empty()) break;
        std::vector<double> residual(kept.size());
        for (std::size_t k = 0; k < kept.size(); ++k) residual[k] = std::fabs(behind[k] - means[kept[k]]);
        std::vector<double> sorted(residual);
        const double limit = std::max(outlier_medians * median(sorted), 1e-9);
        std::size_t inside = 0;
        for (std::size_t k = 0; k < kept.size(); ++k) {
            if (!(residual[k] <= limit)) continue;
            kept[inside] = kept[k];
            behind[inside++] = behind[k];
        }
        kept.resize(inside);
        behind.resize(inside);
    }
    return std::make_tuple(to_numpy(std::move(means)), to_numpy(std::move(counts)));
}

}  // namespace

void bind_cross_sections(nb::module_& m) {
    m.def("window_sum", &window_sum, "values"_a.noconvert(), "path"_a.noconvert(), "half"_a);
    m.def("section_offsets", &section_offsets, "points"_a.noconvert(), "distance"_a.noconvert(), "index"_a.noconvert(),
          "positions"_a.noconvert(), "lateral"_a.noconvert(), "depth"_a.noconvert(), "reach"_a.noconvert());
    m.def("axis_depth", &axis_depth, "sample"_a.noconvert(), "lateral"_a.noconvert(), "depth"_a.noconvert(), "path"_a.noconvert(),
          "radius"_a.noconvert(), "half"_a, "central_part"_a, "outlier_medians"_a);
}
