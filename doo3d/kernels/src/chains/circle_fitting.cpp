// Circles through the points of cross-sections, by the fit of Kasa (1976) and then Gauss-Newton.
#include "pooled_sums.h"

namespace {

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

using Row = std::array<double, 8>;  // the elements of the normal equations, in which the lower triangle is left out

// The points of cross-sections, and sums over those of each sample.
struct Sections {
    const Vector<Index>& sample;
    const Vector<double>&lateral, &depth;
    const PooledSums sums;
};

// Circles through the points of cross-sections, (S,) each.
struct Circles {
    std::vector<double> u, w, radius, count;
};

// Start from the least squares of u^2 + w^2 = 2 a u + 2 b w + c about each sample's mean.
Circles kasa_fit(const Sections& points, double min_points) {
    auto mean = points.sums.of([&](Index k) { return std::array<double, 3>{points.lateral(k), points.depth(k), 1.0}; });
    const Index size = Index(mean[2].size());
    for (Index s = 0; s < size; ++s) {
        for (int c = 0; c < 2; ++c) mean[c][s] /= std::max(mean[2][s], 1e-9);
    }
    const auto sums = points.sums.of([&](Index k) {
        const Index s = points.sample(k);
        const double u = points.lateral(k) - mean[0][s], w = points.depth(k) - mean[1][s], q = u * u + w * w;
        return Row{u * u, u * w, w * w, u, w, u * q, w * q, q};
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
void refine(Circles& circles, const Sections& points, bool fits_radius) {
    const auto sums = points.sums.of([&](Index k) {
        const Index s = points.sample(k);
        const double du = points.lateral(k) - circles.u[s], dw = points.depth(k) - circles.w[s];
        const double distance = std::max(std::sqrt(du * du + dw * dw), 1e-12), residual = distance - circles.radius[s];
        const double nu = du / distance, nw = dw / distance;
        return Row{nu * nu, nu * nw, nw * nw, nu, nw, nu * residual, nw * residual, residual};
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

auto fit_circles(Vector<Index> sample, Vector<double> lateral, Vector<double> depth, Vector<Index> path, Vector<double> radius, Index half,
                 Index steps, double min_points) {
    const std::size_t size = path.shape(0);
    require(lateral.shape(0) == sample.shape(0) && depth.shape(0) == sample.shape(0), "lateral and depth are not one per point");
    require(radius.shape(0) == size || radius.shape(0) == 0, "radius is neither one per sample nor empty");
    require(steps >= 0 && steps <= 1000 && min_points >= 1, "steps are not from 0 to 1000, or min_points is less than 1");
    const Sections points{sample, lateral, depth, {sample, path, half}};
    Circles circles = kasa_fit(points, min_points);
    const bool fits_radius = radius.shape(0) == 0;
    if (!fits_radius) circles.radius = dense(radius);
    for (Index k = 0; k < steps; ++k) refine(circles, points, fits_radius);
    std::vector<double> centers;
    for (std::size_t s = 0; s < size; ++s) {
        centers.insert(centers.end(), {circles.u[s], circles.w[s]});
        if (circles.count[s] < min_points) circles.radius[s] = NAN;
    }
    return std::make_tuple(rows_of(std::move(centers), 2), std::move(circles.radius), std::move(circles.count));
}

}  // namespace

void bind_circle_fitting(Module& m) {
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
    m.def("fit_circles", &fit_circles, "sample"_array, "lateral"_array, "depth"_array, "path"_array, "radius"_array, "half"_a, "steps"_a,
          "min_points"_a);
}
