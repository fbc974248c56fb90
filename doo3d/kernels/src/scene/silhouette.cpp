#include "silhouette.h"

#include "pooling.h"

namespace {

// Samples in the image: their pixels (S, 2), the unit directions across the path (S, 2), and px across per unit of length, signed.
struct Projected {
    std::vector<double> pixels, across, scale;
};

constexpr double PROJECTION_STEP = 1e-4;  // m along an axis, whose projection tells its direction and scale in the image
constexpr double MIN_SCALE = 1e-6;        // px per m; a lateral axis along the ray has no scale in the image

// A step along an axis tells its direction and its scale in the image.
Projected project_samples(const SilhouetteSamples& samples) {
    const Index count = samples.count;
    Projected seen{std::vector<double>(2 * count), std::vector<double>(2 * count), std::vector<double>(count)};
    for (Index s = 0; s < count; ++s) {
        const double* position = samples.positions + 3 * s;
        double ahead[3], beside[3], along[2], moved[2];
        for (Index d = 0; d < 3; ++d) {
            ahead[d] = position[d] + PROJECTION_STEP * samples.tangents[3 * s + d];
            beside[d] = position[d] + PROJECTION_STEP * samples.lateral[3 * s + d];
        }
        double *pixel = seen.pixels.data() + 2 * s, *across = seen.across.data() + 2 * s;
        samples.camera->project(position, pixel);
        samples.camera->project(ahead, along);
        samples.camera->project(beside, moved);
        require(position[2] > 0 && ahead[2] > 0 && beside[2] > 0, "a sample lies behind the camera");
        for (Index d = 0; d < 2; ++d) along[d] -= pixel[d];
        const double square = along[0] * along[0] + along[1] * along[1];
        const double norm = square > 0 ? std::sqrt(square) : 1.0;
        across[0] = -(along[1] / norm);
        across[1] = along[0] / norm;
        const double scale = ((moved[0] - pixel[0]) * across[0] + (moved[1] - pixel[1]) * across[1]) / PROJECTION_STEP;
        seen.scale[s] = std::fabs(scale) > MIN_SCALE ? scale : MIN_SCALE;
    }
    return seen;
}

// Half of the steps in the image to the neighbors on the same path.
std::vector<double> image_lengths(const std::vector<double>& pixels, const std::vector<Index>& path) {
    const Index count = Index(path.size());
    std::vector<double> step(count + 1), lengths(count);
    for (Index s = 1; s < count; ++s) {
        if (path[s] == path[s - 1]) step[s] = std::sqrt(squared_distance(&pixels[2 * s], &pixels[2 * s - 2], 2));
    }
    for (Index s = 0; s < count; ++s) lengths[s] = (step[s] + step[s + 1]) / 2;
    return lengths;
}

auto silhouette(Matrix<double> positions, Matrix<double> tangents, Matrix<double> lateral, Vector<Index> path, Matrix<double> pixels,
                double share, Vector<double> camera, Vector<double> reach, Index half) {
    const Index count = positions.shape(0), dim = positions.shape(1);
    require(camera.shape(0) == (dim == 3 ? 4 : 0) && (dim == 2 || dim == 3), "positions are not (S, 3) with a camera (4,), nor (S, 2) without");
    require(tangents.shape(0) == positions.shape(0) && Index(tangents.shape(1)) == dim, "tangents are not as positions");
    require(lateral.shape(0) == positions.shape(0) && Index(lateral.shape(1)) == dim, "lateral are not as positions");
    require(Index(path.shape(0)) == count && Index(reach.shape(0)) == count, "path and reach are not one per position");
    require(pixels.shape(1) == 2 && half >= 0, "pixels are not (N, 2), or half is negative");
    const std::optional<Camera> view = camera_of(camera);
    const SilhouetteSamples samples{count, positions.data(), tangents.data(), lateral.data(), view ? &*view : nullptr};
    Silhouette found = measure_silhouette(samples, dense(path), {pixels.data(), Index(pixels.shape(0)), share}, dense(reach), half);
    return std::make_tuple(std::move(found.offset), std::move(found.radius));
}

}  // namespace

Silhouette measure_silhouette(const SilhouetteSamples& samples, const std::vector<Index>& path, const MaskPixels& mask,
                              const std::vector<double>& reach, Index half) {
    const Index count = samples.count, size = mask.count;
    const double* pixels = mask.pixels;
    count_visits(count + size);
    const Projected seen = samples.camera ? project_samples(samples)
                                          : Projected{{samples.positions, samples.positions + 2 * count},
                                                      {samples.lateral, samples.lateral + 2 * count},
                                                      std::vector<double>(count, 1.0)};
    std::vector<double> limit(count), counts(count), totals(count);
    double most = 0.0;
    for (Index s = 0; s < count; ++s) {
        require(std::isfinite(seen.pixels[2 * s]) && std::isfinite(seen.pixels[2 * s + 1]), "a sample is not finite");
        limit[s] = reach[s] * std::fabs(seen.scale[s]);
        require(limit[s] > 0 && std::isfinite(limit[s]), "reach is not positive and finite");
        most = std::max(most, limit[s]);
    }
    const NearestOfPoints nearest(pixels, size, seen.pixels.data(), count, 2, most);
    for (Index n = 0; n < size; ++n) {
        const Index s = nearest.index[n];
        if (count == 0 || !(nearest.distance[n] < limit[s])) continue;
        const double *across = &seen.across[2 * s], *pixel = &seen.pixels[2 * s];
        counts[s] += 1;
        totals[s] += (pixels[2 * n] - pixel[0]) * across[0] + (pixels[2 * n + 1] - pixel[1]) * across[1];
    }
    for (Index s = 0; s < count; ++s) {
        counts[s] *= mask.share;
        totals[s] *= mask.share;
    }
    const std::vector<double> number = pooled(counts.data(), path, half), total = pooled(totals.data(), path, half);
    const std::vector<double> length = pooled(image_lengths(seen.pixels, path).data(), path, half);
    Silhouette found{std::vector<double>(count), std::vector<double>(count)};
    for (Index s = 0; s < count; ++s) {
        found.offset[s] = total[s] / std::max(number[s], 1e-9) / seen.scale[s];
        found.radius[s] = number[s] / std::max(length[s], 1e-9) / std::fabs(seen.scale[s]) / 2;
    }
    return found;
}

void bind_silhouette(Module& m) {
    // Measure the middle and half the width of a mask at samples along paths, across the paths.
    //
    // Every pixel belongs to the sample that is nearest in the image. The number of pixels of a sample and of its neighbors over
    // their length in the image is the width; the mean of the pixels' lateral offsets is the middle.
    //
    // Parameters
    // ----------
    // positions, tangents, lateral
    //     (S, 3) float64, S samples m in the camera's optical frame, and two unit axes at each: along the path, and across it;
    //     (S, 2) px without a camera
    // path
    //     (S,) int64, number of the path of each sample; the samples of a path are consecutive
    // pixels, share
    //     (N, 2) float64 px (u, v), and the number of pixels of the mask that each stands for
    // camera
    //     (4,) float64, the intrinsics fx, fy, cx, cy in px; (0,) if positions are px
    // reach
    //     (S,) float64 m (px without a camera); pixels that are not nearer than this to their sample are left out
    // half
    //     number of samples on either side, on the same path, whose pixels are pooled with those of a sample
    //
    // Returns
    // -------
    // offset : (S,) float64 m (px), from the sample to the middle of the mask along the lateral axis; 0 without pixels
    // radius : (S,) float64 m (px), half the width; 0 without pixels. A ValueError says if a sample lies behind the camera
    m.def("silhouette", &silhouette, "positions"_array, "tangents"_array, "lateral"_array, "path"_array, "pixels"_array, "share"_a,
          "camera"_array, "reach"_array, "half"_a);
}
