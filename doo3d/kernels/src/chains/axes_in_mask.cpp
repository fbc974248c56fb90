#include "axis_samples.h"
#include "order_statistics.h"
#include "pooling.h"
#include "polyline.h"
#include "whittaker.h"

namespace {

// Take the median of what was measured along each path for its radius, if anything usable was.
void set_path_radius(Samples& samples, const std::vector<double>& measured) {
    std::vector<double> usable;
    for (Index p = 0; p < samples.paths(); ++p) {
        usable.clear();
        for (Index s = samples.bounds[p]; s < samples.bounds[p + 1]; ++s) {
            if (!samples.filled[s] && measured[s] > 0) usable.push_back(measured[s]);
        }
        const double radius = finite_median(usable, NAN);
        for (Index s = samples.bounds[p]; s < samples.bounds[p + 1] && !std::isnan(radius); ++s) samples.radius[s] = radius;
    }
}

// Set the radius at each sample: the pooled measurement where it is good, interpolated along the path elsewhere, as by np.interp.
void set_radii(Samples& samples, const std::vector<double>& measured, const std::vector<double>& trust) {
    const Index size = samples.size();
    std::vector<double> good(size), kept(size);
    for (Index s = 0; s < size; ++s) {
        good[s] = trust[s] > 0.5 && !samples.filled[s];
        kept[s] = good[s] > 0 ? measured[s] : 0.0;
    }
    const std::vector<double> count = pooled(good.data(), samples.owner, 2 * samples.half);
    std::vector<double> mean = pooled(kept.data(), samples.owner, 2 * samples.half);
    for (Index s = 0; s < size; ++s) mean[s] /= std::max(count[s], 1.0);
    samples.radii = samples.radius;
    for (Index p = 0; p < samples.paths(); ++p) {
        const Index first = samples.bounds[p], length = samples.bounds[p + 1] - first;
        std::vector<Index> known;
        for (Index k = 0; k < length; ++k) {
            if (count[first + k] > 0) known.push_back(k);
        }
        if (known.empty()) continue;
        const std::vector<double> radii = interpolated([&](Index k) { return mean[first + k]; }, length, known);
        std::copy(radii.begin(), radii.end(), samples.radii.begin() + first);
    }
}

// If the weights are too few to determine the result, each point has a least weight of its own.
std::vector<double> smoothed(const std::vector<double>& values, std::vector<double> weights, Index dim, double strength, double least) {
    const Index count = Index(values.size()) / dim;
    try {
        return whittaker(values.data(), weights.data(), count, dim, strength, 2);
    } catch (const nb::builtin_exception&) {
        least *= *std::max_element(weights.begin(), weights.end()) + strength;
        for (Index k = 0; k < count * dim; ++k) weights[k * dim + k % dim] += least;
        return whittaker(values.data(), weights.data(), count, dim, strength, 2);
    }
}

// Append the weight matrix of a sample, (D, D).
void add_weights(Index s, const Samples& samples, const AcrossAxes& axes, const Measured& measured, double path_weight,
                 std::vector<double>& weights) {
    const double *lateral = &axes.lateral[s * samples.dim], *depth = &axes.depth[s * samples.dim];
    for (Index i = 0; i < samples.dim; ++i) {
        for (Index j = 0; j < samples.dim; ++j) {
            const double across = measured.lateral_weight[s] * lateral[i] * lateral[j];
            weights.push_back(across + measured.depth_weight[s] * depth[i] * depth[j] + (i == j ? path_weight : 0.0));
        }
    }
}

// Smooth the measured axis of each path; a ring is continued over its seam.
void smooth(Samples& samples, const AcrossAxes& axes, const Measured& measured, const Settings& settings) {
    const Index dim = samples.dim;
    for (Index p = 0; p < samples.paths(); ++p) {
        const Index first = samples.bounds[p], size = samples.bounds[p + 1] - first;
        std::vector<double> steps, values, weights;
        for (Index s = first; s + 1 < first + size; ++s) {
            const double* position = samples.positions.data() + s * dim;
            steps.push_back(std::sqrt(squared_distance(position + dim, position, dim)));
        }
        const double step = finite_median(steps, NAN), wide = settings.smoothing_radii * samples.radius[first];
        const double strength = least(std::pow(wide / most(step, 1e-9), 4), settings.max_strength);
        const Index overlap = samples.closed[p] ? std::min(Index(settings.ring_overlap), size) : 0;
        for (Index k = -overlap; k < size + overlap; ++k) {
            const Index s = first + (k + size) % size;
            values.insert(values.end(), &measured.target[s * dim], &measured.target[s * dim] + dim);
            add_weights(s, samples, axes, measured, settings.path_weight, weights);
        }
        const std::vector<double> result = smoothed(values, std::move(weights), dim, strength, settings.least_weight);
        std::copy_n(result.data() + overlap * dim, size * dim, samples.positions.data() + first * dim);
    }
}

// Take the middle and the width of the mask, in space also the depth behind the surface, and smooth each path.
void iterate(Samples& samples, const Seen& seen, const Settings& settings) {
    const Index size = samples.size(), dim = samples.dim;
    const std::vector<double> tangents = tangents_along(samples.positions.data(), dim, samples.bounds, samples.closed);
    AcrossAxes axes{std::vector<double>(size * dim), std::vector<double>(size * dim)};
    const double origin[3] = {0.0, 0.0, 0.0};
    if (dim == 3) axes = axes_across(samples.positions.data(), tangents.data(), size, origin);
    for (Index s = 0; s < size && dim == 2; ++s) {
        axes.lateral[2 * s] = -tangents[2 * s + 1];
        axes.lateral[2 * s + 1] = tangents[2 * s];
    }
    std::vector<double> reach(size), trust(size);
    for (Index s = 0; s < size; ++s) reach[s] = settings.touching_radii * samples.radius[s];
    const Silhouette width = measure_silhouette({size, samples.positions.data(), tangents.data(), axes.lateral.data(), seen.camera},
                                                samples.owner, seen.mask, reach, samples.half);
    set_path_radius(samples, width.radius);
    Measured measured{samples.positions, std::vector<double>(size), std::vector<double>(size)};
    for (Index s = 0; s < size; ++s) {
        const double misfit = (width.radius[s] / samples.radius[s] - 1) / settings.radius_tolerance;
        trust[s] = width.radius[s] > 0 ? std::exp(-(misfit * misfit)) : 0.0;
        const double offset = trust[s] > 0.1 ? width.offset[s] : 0.0;
        for (Index d = 0; d < dim; ++d) measured.target[s * dim + d] += offset * axes.lateral[s * dim + d];
        measured.lateral_weight[s] = trust[s] * (samples.filled[s] ? settings.gap_weight : 1.0);
    }
    set_radii(samples, width.radius, trust);
    if (seen.camera) add_depth(samples, axes, seen, settings, measured);
    smooth(samples, axes, measured, settings);
}

Samples samples_of(const Matrix<double>& points, const Vector<Index>& bounds, const Vector<bool>& closed, const Vector<bool>& filled,
                   const Vector<double>& radius, Index half) {
    const std::size_t size = points.shape(0);
    require(points.shape(1) == 2 || points.shape(1) == 3, "points are neither (S, 2) nor (S, 3)");
    require(filled.shape(0) == size && radius.shape(0) == size, "filled and radius are not one per point");
    require(closed.shape(0) + 1 == bounds.shape(0), "closed is not one per path");
    require(size > 0 && half >= 0 && half <= Index(1) << 32, "there are no samples, or half is out of bounds");
    check_bounds(bounds, Index(size));
    const std::vector<double> values = dense(radius);
    Samples samples{Index(points.shape(1)), half, dense(bounds), {}, {}, {}, {points.data(), points.data() + points.size()}, values, values};
    for (Index p = 0; p < samples.paths(); ++p) {
        require(bounds(p + 1) > bounds(p), "a path has no samples");
        samples.owner.insert(samples.owner.end(), bounds(p + 1) - bounds(p), p);
        samples.closed.push_back(closed(p));
    }
    for (std::size_t s = 0; s < size; ++s) samples.filled.push_back(filled(s));
    return samples;
}

auto axes_in_mask(Matrix<double> points, Vector<Index> bounds, Vector<bool> closed, Vector<bool> filled, Vector<double> radius, Index half,
                  Matrix<double> pixels, double share, Matrix<double> surface, Vector<double> camera, Matrix<float> depth,
                  Matrix<bool> mask, Vector<double> plane, Vector<double> beside, Index iterations, double touching_radii, double own_radii,
                  double sunk_radii, double central_part, double smoothing_radii, double max_strength, double least_weight,
                  double ring_overlap, double path_weight, double depth_weight, double gap_weight, double radius_tolerance,
                  double noise_radii, double deviations) {
    Samples samples = samples_of(points, bounds, closed, filled, radius, half);
    const Settings known{touching_radii, own_radii,    sunk_radii, central_part,     smoothing_radii, max_strength, least_weight, ring_overlap,
                         path_weight,    depth_weight, gap_weight, radius_tolerance, noise_radii,     deviations};
    require(pixels.shape(1) == 2 && iterations >= 0 && iterations <= 1000, "pixels are not (N, 2), or iterations not from 0 to 1000");
    require(ring_overlap >= 0 && ring_overlap < 1e9, "the overlap is out of bounds");
    require(camera.shape(0) == (samples.dim == 3 ? 4 : 0), "camera is not (4,) in space, or not (0,) in the image");
    require(samples.dim == 2 || surface.shape(1) == 3, "surface is not (N, 3)");
    require(plane.shape(0) == 4 || plane.shape(0) == 0, "plane is neither (4,) nor (0,)");
    const std::vector<double> normal = dense(plane), off = dense(beside);
    const std::optional<Camera> view = camera_of(camera);
    const PlaneView level{{depth, mask}, view ? &*view : nullptr, normal.data(), off, own_radii, sunk_radii};
    level.readings.check();
    const Seen seen{{pixels.data(), Index(pixels.shape(0)), share}, surface, level.camera, normal.empty() ? nullptr : &level};
    count_visits(samples.size());
    for (Index k = 0; k < iterations; ++k) iterate(samples, seen, known);
    return std::make_tuple(rows_of(std::move(samples.positions), samples.dim), std::move(samples.radius), std::move(samples.radii));
}

}  // namespace

void bind_axes_in_mask(Module& m) {
    // Estimate the axis and the radius of strands in a mask, and with a camera in depth, from samples on the seen surface.
    //
    // In each iteration `silhouette` gives the offset across the line of sight and the radius, whose median is that of the path. The
    // surface points near the samples so moved give the depth, as `axis_depth` does. An axis measured inside a plane is raised to a
    // radius over it where the plane is seen beside the strand. Each path is smoothed by `whittaker_smooth`.
    //
    // Parameters
    // ----------
    // points
    //     (S, D) float64 m in the camera's optical frame, in 2-D px, S samples along C paths
    // bounds
    //     (C + 1,) int64, row of the first sample of each path, and S; a path has one sample at least
    // closed, filled
    //     (C,) bool, True for a ring, and (S,) bool, True for a sample in a gap that was filled
    // radius
    //     (S,) float64 m (px in 2-D), radius of the path of each sample so far
    // half
    //     number of samples on either side, on the same path, whose pixels and points are pooled
    // pixels, share
    //     (N, 2) float64 px, (u, v) of N pixels of the mask, and how many pixels each stands for
    // surface
    //     (M, 3) float64 m, M surface points; not used in 2-D
    // camera
    //     (4,) float64 px, fx, fy, cx, cy; (0,) in 2-D
    // depth, mask
    //     (H, W) float32 m, 0 = no reading, and (H, W) bool, the pixels of the object; both for the plane alone
    // plane
    //     (4,) float64, unit normal and height along it, m; (0,) if there is none
    // beside
    //     (A,) float64 px beyond both sides of a strand at which the plane is read
    // iterations
    //     number of iterations, 0 to 1000
    // touching_radii, own_radii, sunk_radii, central_part
    //     radii up to which pixels and points belong to a sample; of the plane within which the median of the readings beside is of
    //     it; below the plane down to which an axis is raised; from the middle that measure depth
    // smoothing_radii, max_strength, least_weight, ring_overlap
    //     radii over which a path is smoothed; greatest strength; least weight where weights determine nothing, as a share; samples by
    //     which a ring is continued over its seam
    // path_weight, depth_weight, gap_weight
    //     weights of the path, of depth, and in a filled gap
    // radius_tolerance, noise_radii, deviations
    //     relative difference of the radius that weighs 1 / e; radii of noise up to which depth has its weight; standard deviations
    //     of an outlier
    //
    // Returns
    // -------
    // (S, D) float64 m (px in 2-D), the samples on the axes; (S,) radius of their paths; (S,) radius at each.
    //
    // Raises
    // ------
    // ValueError
    //     If a sample lies behind the camera.
    m.def("axes_in_mask", &axes_in_mask, "points"_array, "bounds"_array, "closed"_array, "filled"_array, "radius"_array, "half"_a,
          "pixels"_array, "share"_a, "surface"_array, "camera"_array, "depth"_array, "mask"_array, "plane"_array, "beside"_array,
          "iterations"_a, nb::kw_only(), "touching_radii"_a, "own_radii"_a, "sunk_radii"_a, "central_part"_a, "smoothing_radii"_a,
          "max_strength"_a, "least_weight"_a, "ring_overlap"_a, "path_weight"_a, "depth_weight"_a, "gap_weight"_a, "radius_tolerance"_a,
          "noise_radii"_a, "deviations"_a);
}
