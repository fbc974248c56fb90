// Surface points in the cross-sections of samples along center lines, and what is pooled from them.
#include "cross_sections.h"

#include "order_statistics.h"
#include "pooled_sums.h"

namespace {

auto window_sum(Vector<double> values, Vector<Index> path, Index half) {
    require(values.shape(0) == path.shape(0), "values and path have different lengths");
    require(half >= 0, "half is negative");
    return pooled(dense(values).data(), dense(path), half);
}

auto section_offsets(Matrix<double> points, Vector<double> distance, Vector<Index> index, Matrix<double> positions, Matrix<double> lateral,
                     Matrix<double> depth, Vector<double> reach) {
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
        const auto [u, w] = offsets_in_section(&points(n, 0), &positions(s, 0), &lateral(s, 0), &depth(s, 0));
        sample.push_back(s);
        across.push_back(u);
        behind.push_back(w);
    }
    return std::make_tuple(std::move(sample), std::move(across), std::move(behind));
}

auto axis_depth(Vector<Index> sample, Vector<double> lateral, Vector<double> depth, Vector<Index> path, Vector<double> radius, Index half,
                double central_part, double outlier_medians) {
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
    PooledMeans means = means_without_outliers(std::move(kept), std::move(behind), dense(path), half, outlier_medians);
    return std::make_tuple(std::move(means.mean), std::move(means.count));
}

// Return the square and write what rounding lost of it (Dekker, 1971).
double square_of(double x, double& lost) {
    const double square = x * x, scaled = 134217729.0 * x, high = scaled - (scaled - x), low = x - high;
    lost = (high * high - square + 2 * high * low) + low * low;
    return square;
}

// Return x^4 as `pow` rounds it, in a tenth of its time.
double fourth_power(double x) {
    double lost, rest;
    const double square = square_of(x, lost), result = square_of(square, rest);
    return result + (rest + 2 * square * lost);
}

auto half_shell_spread(Vector<Index> sample, Vector<double> lateral, Vector<Index> path, Index half) {
    require(lateral.shape(0) == sample.shape(0), "lateral is not one per point");
    const Index size = path.shape(0), count = sample.shape(0);
    const PooledSums sums(sample, path, half);
    auto [number, middle] = sums.of([&](Index k) { return std::array<double, 2>{1.0, lateral(k)}; });
    for (Index s = 0; s < size; ++s) middle[s] /= std::max(number[s], 1e-9);
    std::vector<double> relative(count);
    for (Index k = 0; k < count; ++k) relative[k] = lateral(k) - middle[sample(k)];
    std::vector<double> variance = sums.of([&](Index k) { return std::array<double, 1>{relative[k] * relative[k]}; })[0];
    for (Index s = 0; s < size; ++s) variance[s] /= std::max(number[s], 1e-9);
    for (Index k = 0; k < count; ++k) relative[k] = fourth_power(relative[k] / std::sqrt(std::max(variance[sample(k)], 1e-18)));
    return std::make_tuple(std::move(middle), std::move(variance), std::move(number), std::move(relative));
}

}  // namespace

PooledMeans means_without_outliers(std::vector<Index> sample, std::vector<double> values, const std::vector<Index>& path, Index half,
                                   double outlier_medians) {
    const Index size = Index(path.size());
    PooledMeans means;
    for (const bool last : {false, true}) {
        count_visits(Index(sample.size()));
        std::vector<double> number(size), total(size);
        for (std::size_t k = 0; k < sample.size(); ++k) {
            number[sample[k]] += 1;
            total[sample[k]] += values[k];
        }
        means = {pooled(total.data(), path, half), pooled(number.data(), path, half)};
        for (Index s = 0; s < size; ++s) means.mean[s] /= std::max(means.count[s], 1e-9);
        if (last || sample.empty()) break;
        std::vector<double> residual(sample.size());
        for (std::size_t k = 0; k < sample.size(); ++k) residual[k] = std::fabs(values[k] - means.mean[sample[k]]);
        const double limit = std::max(outlier_medians * median(residual), 1e-9);
        std::size_t inside = 0;
        for (std::size_t k = 0; k < sample.size(); ++k) {
            if (!(residual[k] <= limit)) continue;
            sample[inside] = sample[k];
            values[inside++] = values[k];
        }
        sample.resize(inside);
        values.resize(inside);
    }
    return means;
}

void bind_cross_sections(Module& m) {
    // Return at each sample the sum of the values at the sample and at its neighbors on the same path.
    //
    // Parameters
    // ----------
    // values
    //     (S,) float64, a value at each of S samples
    // path
    //     (S,) int64, number of the path that each sample lies on; the samples of one path are consecutive
    // half
    //     number of neighbors on either side that are summed; fewer at the first and last samples of a path, also of a ring
    //
    // Returns
    // -------
    // (S,) float64. The sums are differences of one running total, so they carry its rounding.
    m.def("window_sum", &window_sum, "values"_array, "path"_array, "half"_a);
    // Return the offsets of points from their nearest samples, across the line of sight and along it.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64 m, N surface points
    // distance, index
    //     (N,) float64 and (N,) int64, distance and index of each point's nearest sample, as `nearest` returns them
    // positions, lateral, depth
    //     (S, 3) float64, S samples along the object, m, and two unit axes of the cross-section at each
    // reach
    //     (S,) float64 m; points that are not nearer than this to their sample are left out
    //
    // Returns
    // -------
    // sample : (K,) int64, the sample of each of the K points that are left
    // u, w : (K,) float64 m, their offsets from the sample along its lateral and its depth axis
    m.def("section_offsets", &section_offsets, "points"_array, "distance"_array, "index"_array, "positions"_array, "lateral"_array,
          "depth"_array, "reach"_array);
    // Average how far behind each sample the axis of the object lies, over the surface points near it.
    //
    // A point with the lateral offset u and the depth offset w tells w + sqrt(r^2 - u^2), where r is the radius.
    //
    // Parameters
    // ----------
    // sample
    //     (N,) int64, index of the sample in whose cross-section each of N points lies
    // lateral, depth
    //     (N,) float64 m, offsets of each point from its sample across the line of sight and along it
    // path
    //     (S,) int64, number of the path that each of S samples lies on; the samples of one path are consecutive
    // radius
    //     (S,) float64 m, radius of the object at each sample
    // half
    //     number of samples on either side, on the same path, whose points are pooled
    // central_part
    //     radii from the middle within which points count
    // outlier_medians
    //     medians of the absolute residual beyond which a point is left out of the second average
    //
    // Returns
    // -------
    // mean : (S,) float64 m, positive away from the sensor; 0 where there are no points
    // count : (S,) float64, number of points in each mean
    m.def("axis_depth", &axis_depth, "sample"_array, "lateral"_array, "depth"_array, "path"_array, "radius"_array, "half"_a,
          "central_part"_a, "outlier_medians"_a);
    // Measure how the points of each cross-section spread across the line of sight.
    //
    // Parameters
    // ----------
    // sample
    //     (N,) int64, index of the sample in whose cross-section each of N points lies
    // lateral
    //     (N,) float64 m, lateral offset of each point from its sample
    // path
    //     (S,) int64, number of the path that each of S samples lies on; the samples of one path are consecutive
    // half
    //     number of samples on either side, on the same path, whose points are pooled
    //
    // Returns
    // -------
    // middle : (S,) float64 m, mean offset
    // variance : (S,) float64 m^2
    // count : (S,) float64, number of points, after pooling
    // fourth : (N,) float64, fourth power of the offset of each point from the middle in standard deviations
    m.def("half_shell_spread", &half_shell_spread, "sample"_array, "lateral"_array, "path"_array, "half"_a);
}
