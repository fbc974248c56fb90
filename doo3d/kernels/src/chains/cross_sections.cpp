// Surface points in the cross-sections of samples along center lines, and what is pooled from them.
#include "cross_sections.h"

#include "order_statistics.h"
#include "pooling.h"

#include <array>

namespace {

auto window_sum(Vector<double> values, Vector<Index> path, Index half) {
    require(values.shape(0) == path.shape(0), "values and path have different lengths");
    require(half >= 0, "half is negative");
    return to_numpy(pooled(dense(values).data(), path, half));
}

auto section_offsets(Matrix<double> points, Vector<double> distance, Vector<Index> index, Matrix<double> positions,
                     Matrix<double> lateral, Matrix<double> depth, Vector<double> reach) {
    const Index count = points.shape(0), size = positions.shape(0);
    require(points.shape(1) == 3 && positions.shape(1) == 3, "points and positions are not (., 3)");
    require(lateral.shape(1) == 3 && depth.shape(1) == 3, "lateral and depth are not (., 3)");
    require(Index(distance.shape(0)) == count && Index(index.shape(0)) == count, "distance and index are not one per point");
    require(Index(lateral.shape(0)) == size && Index(depth.shape(0)) == size && Index(reach.shape(0)) == size,
            "lateral, depth and reach are not one per position");
    ReleasedGil released;
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
    released.end();
    return std::make_tuple(to_numpy(std::move(sample)), to_numpy(std::move(across)), to_numpy(std::move(behind)));
}

auto axis_depth(Vector<Index> sample, Vector<double> lateral, Vector<double> depth, Vector<Index> path, Vector<double> radius,
                Index half, double central_part, double outlier_medians) {
    const Index count = sample.shape(0), size = path.shape(0);
    require(Index(lateral.shape(0)) == count && Index(depth.shape(0)) == count, "lateral and depth are not one per point");
    require(Index(radius.shape(0)) == size, "radius is not one per sample");
    require(half >= 0, "half is negative");
    ReleasedGil released;
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
    PooledMeans means = means_without_outliers(std::move(kept), std::move(behind), path, half, outlier_medians);
    released.end();
    return std::make_tuple(to_numpy(std::move(means.mean)), to_numpy(std::move(means.count)));
}

void cross(const double* a, const double* b, double* result) {
    for (int d = 0; d < 3; ++d) result[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

// Write the vector scaled to length 1; return false for one that is shorter than `least`.
bool scale_to_unit(const double* vector, double least, double* result) {
    const double square = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
    if (square <= least * least) return false;
    for (int d = 0; d < 3; ++d) result[d] = vector[d] / std::sqrt(square);
    return true;
}

// Write the part of a vector that is perpendicular to a unit vector.
void without(const double* vector, const double* direction, double* result) {
    const double along = vector[0] * direction[0] + vector[1] * direction[1] + vector[2] * direction[2];
    for (int d = 0; d < 3; ++d) result[d] = vector[d] - along * direction[d];
}

// Write a unit vector perpendicular to a direction, made from the coordinate axis that it is least along.
void perpendicular(const double* direction, double* result) {
    int least = 0;
    for (int d = 1; d < 3; ++d) {
        if (std::fabs(direction[d]) < std::fabs(direction[least])) least = d;
    }
    double axis[3] = {0, 0, 0}, side[3];
    axis[least] = 1.0;
    without(axis, direction, side);
    if (!scale_to_unit(side, 0.0, result)) std::copy(axis, axis + 3, result);
}

auto section_axes(Matrix<double> positions, Matrix<double> tangents, Vector<double> viewpoint) {
    const Index size = positions.shape(0);
    require(positions.shape(1) == 3 && tangents.shape(1) == 3, "positions and tangents are not (S, 3)");
    require(Index(tangents.shape(0)) == size, "tangents are not one per position");
    require(viewpoint.shape(0) == 0 || viewpoint.shape(0) == 3, "viewpoint is neither (3,) nor (0,)");
    const std::vector<double> seen_from = dense(viewpoint);
    AcrossAxes axes = axes_across(positions.data(), tangents.data(), size, seen_from.empty() ? nullptr : seen_from.data());
    return std::make_tuple(to_numpy(std::move(axes.lateral), size, 3), to_numpy(std::move(axes.depth), size, 3));
}

void check_sections(const Vector<Index>& sample, const Vector<double>& lateral, const Vector<Index>& path, Index half) {
    require(lateral.shape(0) == sample.shape(0), "lateral is not one per point");
    require(half >= 0, "half is negative");
    const Index size = path.shape(0);
    for (std::size_t k = 0; k < sample.shape(0); ++k) {
        require(sample(k) >= 0 && sample(k) < size, "an index lies outside the samples");
    }
}

// Sums over the points of each sample, and of its neighbors on the same path: one column for each value of a point.
class PooledSums {
public:
    PooledSums(const Vector<Index>& sample, const Vector<Index>& path, Index half) : sample_(sample), path_(path), half_(half) {}

    // Call `values(k, row)`, which writes a row of values for point k; return the sums, one vector a column.
    template <Index Columns, class Values>
    std::vector<std::vector<double>> of(Values values) const {
        const std::size_t size = path_.shape(0);
        std::vector<double> sums(size * Columns), column(size);
        std::array<double, Columns> row;
        for (std::size_t k = 0; k < sample_.shape(0); ++k) {
            values(Index(k), row.data());
            double* to = sums.data() + sample_(k) * Columns;
            for (Index c = 0; c < Columns; ++c) to[c] += row[c];
        }
        std::vector<std::vector<double>> result;
        for (Index c = 0; c < Columns; ++c) {
            for (std::size_t s = 0; s < size; ++s) column[s] = sums[s * Columns + c];
            result.push_back(pooled(column.data(), path_, half_));
        }
        return result;
    }

private:
    const Vector<Index>& sample_;
    const Vector<Index>& path_;
    Index half_;
};

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
    check_sections(sample, lateral, path, half);
    ReleasedGil released;
    const Index size = path.shape(0), count = sample.shape(0);
    const PooledSums pooled(sample, path, half);
    auto first = pooled.of<2>([&](Index k, double* row) {
        row[0] = 1.0;
        row[1] = lateral(k);
    });
    for (Index s = 0; s < size; ++s) first[1][s] /= std::max(first[0][s], 1e-9);
    std::vector<double> relative(count);
    for (Index k = 0; k < count; ++k) relative[k] = lateral(k) - first[1][sample(k)];
    auto variance = pooled.of<1>([&](Index k, double* row) { row[0] = relative[k] * relative[k]; })[0];
    for (Index s = 0; s < size; ++s) variance[s] /= std::max(first[0][s], 1e-9);
    for (Index k = 0; k < count; ++k) relative[k] = fourth_power(relative[k] / std::sqrt(std::max(variance[sample(k)], 1e-18)));
    released.end();
    return std::make_tuple(to_numpy(std::move(first[1])), to_numpy(std::move(variance)), to_numpy(std::move(first[0])),
                           to_numpy(std::move(relative)));
}

// Solve three linear equations by elimination with partial pivoting; the result takes the place of the right side.
void solve(double a[3][3], double* b) {
    for (int i = 0; i < 3; ++i) {
        int pivot = i;
        for (int k = i + 1; k < 3; ++k) {
            if (std::fabs(a[k][i]) > std::fabs(a[pivot][i])) pivot = k;
        }
        std::swap_ranges(a[i], a[i] + 3, a[pivot]);
        std::swap(b[i], b[pivot]);
        for (int k = i + 1; k < 3; ++k) {
            const double factor = a[k][i] / a[i][i];
            for (int j = i; j < 3; ++j) a[k][j] -= factor * a[i][j];
            b[k] -= factor * b[i];
        }
    }
    for (int i = 2; i >= 0; --i) {
        for (int j = i + 1; j < 3; ++j) b[i] -= a[i][j] * b[j];
        b[i] /= a[i][i];
    }
}

// Circles through the points of cross-sections, (S,) each.
struct Circles {
    std::vector<double> u, w, radius, count;
};

// Start from the least squares of u^2 + w^2 = 2 a u + 2 b w + c about each sample's mean.
Circles kasa_fit(const Vector<Index>& sample, const Vector<double>& lateral, const Vector<double>& depth, const PooledSums& pooled,
                 double min_points) {
    auto mean = pooled.of<3>([&](Index k, double* row) {
        row[0] = lateral(k);
        row[1] = depth(k);
        row[2] = 1.0;
    });
    const Index size = Index(mean[2].size());
    for (Index s = 0; s < size; ++s) {
        for (int c = 0; c < 2; ++c) mean[c][s] /= std::max(mean[2][s], 1e-9);
    }
    const auto sums = pooled.of<8>([&](Index k, double* row) {
        const double u = lateral(k) - mean[0][sample(k)], w = depth(k) - mean[1][sample(k)], q = u * u + w * w;
        const double values[8] = {u * u, u * w, w * w, u, w, u * q, w * q, q};
        std::copy(values, values + 8, row);
    });
    Circles circles{mean[0], mean[1], std::vector<double>(size), mean[2]};
    for (Index s = 0; s < size; ++s) {
        if (circles.count[s] < min_points) continue;
        const double ridge = 1e-6 * std::max(sums[0][s] + sums[2][s], 1e-18);
        double matrix[3][3] = {{sums[0][s] + ridge, sums[1][s], sums[3][s]},
                               {sums[1][s], sums[2][s] + ridge, sums[4][s]},
                               {sums[3][s], sums[4][s], circles.count[s]}};
        double abc[3] = {sums[5][s], sums[6][s], sums[7][s]};
        solve(matrix, abc);
        circles.u[s] += abc[0] / 2;
        circles.w[s] += abc[1] / 2;
        circles.radius[s] = std::sqrt(std::max(abc[2] + (abc[0] * abc[0] + abc[1] * abc[1]) / 4, 0.0));
    }
    return circles;
}

// One step of Gauss-Newton; a step is at most half a radius long, and is damped where the points leave it open.
void refine(Circles& circles, const Vector<Index>& sample, const Vector<double>& lateral, const Vector<double>& depth,
            const PooledSums& pooled, bool fits_radius) {
    const auto sums = pooled.of<8>([&](Index k, double* row) {
        const Index s = sample(k);
        const double du = lateral(k) - circles.u[s], dw = depth(k) - circles.w[s];
        const double distance = std::max(std::sqrt(du * du + dw * dw), 1e-12), residual = distance - circles.radius[s];
        const double nu = du / distance, nw = dw / distance;
        const double values[8] = {nu * nu, nu * nw, nw * nw, nu, nw, nu * residual, nw * residual, residual};
        std::copy(values, values + 8, row);
    });
    for (std::size_t s = 0; s < circles.u.size(); ++s) {
        const double ridge = 1e-3 * std::max(circles.count[s], 1e-9), radial = fits_radius ? 1.0 : 0.0;
        double matrix[3][3] = {{sums[0][s] + ridge, sums[1][s], radial * sums[3][s]},
                               {sums[1][s], sums[2][s] + ridge, radial * sums[4][s]},
                               {radial * sums[3][s], radial * sums[4][s], radial * circles.count[s] + ridge}};
        double step[3] = {sums[5][s], sums[6][s], radial * sums[7][s]};
        solve(matrix, step);
        const double limit = std::max(circles.radius[s], 1e-9) / 2;
        circles.u[s] += std::clamp(step[0], -limit, limit);
        circles.w[s] += std::clamp(step[1], -limit, limit);
        circles.radius[s] += std::clamp(step[2], -limit, limit);
    }
}

auto fit_circles(Vector<Index> sample, Vector<double> lateral, Vector<double> depth, Vector<Index> path, Vector<double> radius,
                 Index half, Index steps, double min_points) {
    check_sections(sample, lateral, path, half);
    const std::size_t size = path.shape(0);
    require(depth.shape(0) == sample.shape(0), "depth is not one per point");
    require(radius.shape(0) == size || radius.shape(0) == 0, "radius is neither one per sample nor empty");
    require(steps >= 0 && steps <= 1000 && min_points >= 1, "steps are not from 0 to 1000, or min_points is less than 1");
    ReleasedGil released;
    const PooledSums pooled(sample, path, half);
    Circles circles = kasa_fit(sample, lateral, depth, pooled, min_points);
    const bool fits_radius = radius.shape(0) == 0;
    for (std::size_t s = 0; !fits_radius && s < size; ++s) circles.radius[s] = radius(s);
    for (Index k = 0; k < steps; ++k) refine(circles, sample, lateral, depth, pooled, fits_radius);
    std::vector<double> centers(2 * size);
    for (std::size_t s = 0; s < size; ++s) {
        centers[2 * s] = circles.u[s];
        centers[2 * s + 1] = circles.w[s];
        if (circles.count[s] < min_points) circles.radius[s] = NAN;
    }
    released.end();
    return std::make_tuple(to_numpy(std::move(centers), size, 2), to_numpy(std::move(circles.radius)), to_numpy(std::move(circles.count)));
}

}  // namespace

AcrossAxes axes_across(const double* positions, const double* tangents, Index size, const double* viewpoint) {
    count_visits(size);
    AcrossAxes axes{std::vector<double>(3 * size), std::vector<double>(3 * size)};
    double side[3];
    for (Index s = 0; s < size; ++s) {
        const double* tangent = tangents + 3 * s;
        double *lateral = axes.lateral.data() + 3 * s, least = 0.0;
        if (viewpoint) {
            double ray[3];
            for (int d = 0; d < 3; ++d) ray[d] = positions[3 * s + d] - viewpoint[d];
            cross(ray, tangent, side);
        } else if (s > 0) {
            without(lateral - 3, tangent, side);
            least = 1e-6;
        } else {
            perpendicular(tangent, side);
        }
        if (!scale_to_unit(side, least, lateral)) perpendicular(tangent, lateral);
        cross(tangent, lateral, axes.depth.data() + 3 * s);
    }
    return axes;
}

PooledMeans means_without_outliers(std::vector<Index> sample, std::vector<double> values, const Values<Index>& path, Index half,
                                   double outlier_medians) {
    const Index size = path.size();
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
    m.def("window_sum", &window_sum, "values"_a.noconvert(), "path"_a.noconvert(), "half"_a);
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
    m.def("section_offsets", &section_offsets, "points"_a.noconvert(), "distance"_a.noconvert(), "index"_a.noconvert(),
          "positions"_a.noconvert(), "lateral"_a.noconvert(), "depth"_a.noconvert(), "reach"_a.noconvert());
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
    m.def("axis_depth", &axis_depth, "sample"_a.noconvert(), "lateral"_a.noconvert(), "depth"_a.noconvert(), "path"_a.noconvert(),
          "radius"_a.noconvert(), "half"_a, "central_part"_a, "outlier_medians"_a);
    // Return two unit axes across the object at each sample: across the line of sight, and away from the sensor.
    //
    // Parameters
    // ----------
    // positions
    //     (S, 3) float64 m
    // tangents
    //     (S, 3) float64 unit, along the object
    // viewpoint
    //     (3,) float64 m, position of the sensor; (0,) if unknown: the axes then turn as little as they can from sample to sample
    //
    // Returns
    // -------
    // lateral : (S, 3) float64; arbitrary where the object points at the sensor
    // depth : (S, 3) float64, tangent x lateral
    m.def("section_axes", &section_axes, "positions"_a.noconvert(), "tangents"_a.noconvert(), "viewpoint"_a.noconvert());
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
    m.def("half_shell_spread", &half_shell_spread, "sample"_a.noconvert(), "lateral"_a.noconvert(), "path"_a.noconvert(), "half"_a);
    // Fit a circle to the points of each cross-section by least squares (Gauss-Newton, started from the fit of Kasa, 1976).
    //
    // Parameters
    // ----------
    // sample
    //     (N,) int64, index of the sample in whose cross-section each of N points lies
    // lateral, depth
    //     (N,) float64 m, offsets of each point from its sample
    // path
    //     (S,) int64, number of the path that each of S samples lies on; the samples of one path are consecutive
    // radius
    //     (S,) float64 m, fixes the radius of the circles; (0,) fits the radius too
    // half
    //     number of samples on either side, on the same path, whose points are pooled
    // steps
    //     iterations of Gauss-Newton, 0 to 1000
    // min_points
    //     points that a circle is fitted to at least
    //
    // Returns
    // -------
    // center : (S, 2) float64 m, lateral and depth offset of the circle's center; meaningless where the radius is NaN
    // radius : (S,) float64 m; NaN where there are too few points
    // count : (S,) float64, number of points, after pooling
    m.def("fit_circles", &fit_circles, "sample"_a.noconvert(), "lateral"_a.noconvert(), "depth"_a.noconvert(), "path"_a.noconvert(),
          "radius"_a.noconvert(), "half"_a, "steps"_a, "min_points"_a);
}
