// The middle and the width of a mask across paths.
#include "find_nearest.h"
#include "pooling.h"

namespace {

// Samples in the image: their pixels (S, 2), the unit directions across the path (S, 2), and px across per unit of length, signed.
struct Projected {
    std::vector<double> pixels, across, scale;
};

struct Pinhole {
    const double fx, fy, cx, cy;

    void project(const double* point, double* pixel) const {
        pixel[0] = fx * point[0] / point[2] + cx;
        pixel[1] = fy * point[1] / point[2] + cy;
    }
};

// A step along an axis tells its direction and its scale in the image.
Projected project_samples(const Matrix<double>& positions, const Matrix<double>& tangents, const Matrix<double>& lateral,
                          const Pinhole& camera, double step, double min_scale) {
    const Index count = positions.shape(0);
    Projected seen{std::vector<double>(2 * count), std::vector<double>(2 * count), std::vector<double>(count)};
    for (Index s = 0; s < count; ++s) {
        double ahead[3], beside[3], along[2], moved[2];
        for (Index d = 0; d < 3; ++d) {
            ahead[d] = positions(s, d) + step * tangents(s, d);
            beside[d] = positions(s, d) + step * lateral(s, d);
        }
        double *pixel = seen.pixels.data() + 2 * s, *across = seen.across.data() + 2 * s;
        camera.project(positions.data() + 3 * s, pixel);
        camera.project(ahead, along);
        camera.project(beside, moved);
        require(positions(s, 2) > 0 && ahead[2] > 0 && beside[2] > 0, "a sample lies behind the camera");
        for (Index d = 0; d < 2; ++d) along[d] -= pixel[d];
        const double square = along[0] * along[0] + along[1] * along[1];
        const double norm = square > 0 ? std::sqrt(square) : 1.0;
        across[0] = -(along[1] / norm);
        across[1] = along[0] / norm;
        const double scale = ((moved[0] - pixel[0]) * across[0] + (moved[1] - pixel[1]) * across[1]) / step;
        seen.scale[s] = std::fabs(scale) > min_scale ? scale : min_scale;
    }
    return seen;
}

// Half of the steps in the image to the neighbors on the same path.
std::vector<double> image_lengths(const std::vector<double>& pixels, const Vector<Index>& path) {
    const Index count = path.shape(0);
    std::vector<double> step(count + 1), lengths(count);
    for (Index s = 1; s < count; ++s) {
        if (path(s) == path(s - 1)) step[s] = std::sqrt(squared_distance(&pixels[2 * s], &pixels[2 * s - 2], 2));
    }
    for (Index s = 0; s < count; ++s) lengths[s] = (step[s] + step[s + 1]) / 2;
    return lengths;
}

// Every pixel belongs to the nearest sample. The number of pixels of a sample over its length in the image is the width there.
auto silhouette(Matrix<double> positions, Matrix<double> tangents, Matrix<double> lateral, Vector<Index> path, Matrix<double> pixels,
                double share, Vector<double> camera, Vector<double> reach, Index half, double step, double min_scale) {
    const Index count = positions.shape(0), dim = positions.shape(1);
    const bool planar = camera.shape(0) == 0;
    require(dim == (planar ? 2 : 3) && (planar || camera.shape(0) == 4), "positions are not (S, 3) with a camera (4,), nor (S, 2) without");
    require(tangents.shape(0) == positions.shape(0) && Index(tangents.shape(1)) == dim, "tangents are not as positions");
    require(lateral.shape(0) == positions.shape(0) && Index(lateral.shape(1)) == dim, "lateral are not as positions");
    require(Index(path.shape(0)) == count && Index(reach.shape(0)) == count, "path and reach are not one per position");
    require(pixels.shape(1) == 2 && half >= 0 && step > 0, "pixels are not (N, 2), or half or step are out of bounds");
    count_visits(count + Index(pixels.shape(0)));
    std::vector<double> offset(count), radius(count);
    {
        nb::gil_scoped_release released;
        const Projected seen = planar ? Projected{{positions.data(), positions.data() + 2 * count},
                                                  {lateral.data(), lateral.data() + 2 * count},
                                                  std::vector<double>(count, 1.0)}
                                      : project_samples(positions, tangents, lateral, Pinhole{camera(0), camera(1), camera(2), camera(3)},
                                                        step, min_scale);
        std::vector<double> limit(count), counts(count), totals(count);
        double most = 0.0;
        for (Index s = 0; s < count; ++s) {
            require(std::isfinite(seen.pixels[2 * s]) && std::isfinite(seen.pixels[2 * s + 1]), "a sample is not finite");
            limit[s] = reach(s) * std::fabs(seen.scale[s]);
            require(limit[s] > 0 && std::isfinite(limit[s]), "reach is not positive and finite");
            most = std::max(most, limit[s]);
        }
        std::vector<double> distance(pixels.shape(0), INFINITY);
        std::vector<Index> owner(pixels.shape(0));
        find_nearest({seen.pixels.data(), count, 2, distance.data(), owner.data()}, pixels.data(), pixels.shape(0), most, true);
        for (std::size_t n = 0; n < pixels.shape(0); ++n) {
            const Index s = owner[n];
            if (count == 0 || !(distance[n] < limit[s])) continue;
            const double *across = &seen.across[2 * s], *pixel = &seen.pixels[2 * s];
            counts[s] += 1;
            totals[s] += (pixels(n, 0) - pixel[0]) * across[0] + (pixels(n, 1) - pixel[1]) * across[1];
        }
        for (Index s = 0; s < count; ++s) {
            counts[s] *= share;
            totals[s] *= share;
        }
        const std::vector<double> number = pooled(counts.data(), path, half), total = pooled(totals.data(), path, half);
        const std::vector<double> length = pooled(image_lengths(seen.pixels, path).data(), path, half);
        for (Index s = 0; s < count; ++s) {
            offset[s] = total[s] / std::max(number[s], 1e-9) / seen.scale[s];
            radius[s] = number[s] / std::max(length[s], 1e-9) / std::fabs(seen.scale[s]) / 2;
        }
    }
    return std::make_tuple(to_numpy(std::move(offset)), to_numpy(std::move(radius)));
}

}  // namespace

void bind_silhouette(nb::module_& m) {
    m.def("silhouette", &silhouette, "positions"_a.noconvert(), "tangents"_a.noconvert(), "lateral"_a.noconvert(), "path"_a.noconvert(),
          "pixels"_a.noconvert(), "share"_a, "camera"_a.noconvert(), "reach"_a.noconvert(), "half"_a, "step"_a, "min_scale"_a);
}
