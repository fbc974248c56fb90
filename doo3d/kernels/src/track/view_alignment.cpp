// One step of direct RGB-D alignment of two small views: brightness and inverse depth, robustly weighted.
#include "arrays.h"
#include "order_statistics.h"

namespace {

using Slopes = std::array<double, 8>;  // by three turns, three shifts, gain and offset of the brightness
using Image = Matrix<float>;

// Least noise of brightness, a level of 256, and of inverse depth, 1/m, a step of its numbers.
constexpr double LEAST_GRAY_NOISE = 1.0, LEAST_INVERSE_NOISE = 1e-3;

// Two views of h x w pixels, and how the second is thought to lie.
struct Views {
    const Image &from_gray, &from_inverse, &to_gray, &to_inverse;
    const Vector<double>&intrinsics, &light;
    const Matrix<double>& pose;
    Index height, width;
};

struct Pixel {
    double gray, inverse;  // residuals; inverse is NaN where the second view has no depth
    Slopes by_gray, by_inverse;
};

// Read an image between four pixels, with its slope along u and v; NaN if one of them is unknown.
std::array<double, 3> between(const Image& image, double u, double v, Index width) {
    const Index x = Index(u), y = Index(v);
    const double s = u - double(x), t = v - double(y);
    const float* p = image.data() + y * width + x;
    const double a = p[0], b = p[1], c = p[width], d = p[width + 1];
    const double upper = a + s * (b - a), lower = c + s * (d - c);
    return {upper + t * (lower - upper), (1 - t) * (b - a) + t * (d - c), lower - upper};
}

// Return the residuals of a pixel of the first view; false if the second does not show it.
bool compare(const Views& views, Index row, Index column, Pixel& pixel) {
    const double gray = views.from_gray.data()[row * views.width + column];
    const double inverse = views.from_inverse.data()[row * views.width + column];
    if (std::isnan(gray) || std::isnan(inverse)) return false;
    const double fx = views.intrinsics(0), fy = views.intrinsics(1), cx = views.intrinsics(2), cy = views.intrinsics(3);
    const double ray[3] = {(double(column) - cx) / fx, (double(row) - cy) / fy, 1.0};
    double at[3];
    for (Index i = 0; i < 3; ++i) {
        const double* p = views.pose.data() + 4 * i;
        at[i] = p[0] * ray[0] + p[1] * ray[1] + p[2] * ray[2] + p[3] * inverse;
    }
    if (at[2] <= 0) return false;
    const double x = at[0] / at[2], y = at[1] / at[2], q = inverse / at[2];
    const double u = fx * x + cx, v = fy * y + cy;
    if (!(u >= 0 && v >= 0 && u < double(views.width - 1) && v < double(views.height - 1))) return false;
    const auto [seen, along_u, along_v] = between(views.to_gray, u, v, views.width);
    if (std::isnan(seen)) return false;
    const double du[6] = {-fx * x * y, fx * (1 + x * x), -fx * y, fx * q, 0.0, -fx * q * x};
    const double dv[6] = {-fy * (1 + y * y), fy * x * y, fy * x, 0.0, fy * q, -fy * q * y};
    const double dq[6] = {-q * y, q * x, 0.0, 0.0, 0.0, -q * q};
    pixel.gray = seen - views.light(0) * gray - views.light(1);
    for (Index k = 0; k < 6; ++k) pixel.by_gray[k] = along_u * du[k] + along_v * dv[k];
    pixel.by_gray[6] = -gray;
    pixel.by_gray[7] = -1.0;
    const auto [read, read_u, read_v] = between(views.to_inverse, u, v, views.width);
    pixel.inverse = read - q;
    for (Index k = 0; k < 6; ++k) pixel.by_inverse[k] = read_u * du[k] + read_v * dv[k] - dq[k];
    pixel.by_inverse[6] = pixel.by_inverse[7] = 0.0;
    return true;
}

// Add a residual to the normal equations, and return its loss; at `outlier` standard deviations it weighs a quarter.
WITH_AVX2 double add(double residual, const Slopes& slope, double noise, double outlier, double* __restrict sums) {
    const std::size_t count = slope.size();
    const double r = residual / noise, shrunk = 1 / (1 + r * r / (outlier * outlier));
    const double weight = shrunk * shrunk / (noise * noise);
    for (std::size_t i = 0; i < count; ++i) {
        double* __restrict row = sums + i * (count + 1);
        const double scaled = weight * slope[i];
        UNROLLED
        for (std::size_t j = 0; j < count; ++j) row[j] += scaled * slope[j];  // all of a row: eight at once
        row[count] -= scaled * residual;
    }
    return r * r * shrunk / 2;
}

// Return a standard deviation that is given, or where it is 0 that of residuals, if there are any.
double noise_of(double given, const std::vector<double>& residuals, double least) {
    return given > 0 || residuals.empty() ? given : most(MAD_TO_DEVIATION * absolute_median(residuals), least);
}

auto view_alignment(Image from_gray, Image from_inverse, Image to_gray, Image to_inverse, Vector<double> intrinsics, Matrix<double> pose,
                    Vector<double> light, Vector<double> noise, double outlier) {
    const Index height = Index(from_gray.shape(0)), width = Index(from_gray.shape(1));
    for (const Image* each : {&from_inverse, &to_gray, &to_inverse}) {
        require(Index(each->shape(0)) == height && Index(each->shape(1)) == width, "the images are not all of one shape (H, W)");
    }
    require(intrinsics.shape(0) == 4 && pose.shape(0) == 4 && pose.shape(1) == 4, "intrinsics and pose are not (4,) and (4, 4)");
    require(light.shape(0) == 2 && noise.shape(0) == 2, "light or noise is not (2,)");
    count_visits(2 * height * width);
    const Views views{from_gray, from_inverse, to_gray, to_inverse, intrinsics, light, pose, height, width};
    std::vector<Pixel> pixels;
    pixels.reserve(std::size_t(height * width));
    std::vector<double> grays, inverses;
    Index known = 0;
    for (Index row = 0; row < height; ++row) {
        for (Index column = 0; column < width; ++column) {
            known += !std::isnan(from_gray.data()[row * width + column] + from_inverse.data()[row * width + column]);
            Pixel pixel;
            if (!compare(views, row, column, pixel)) continue;
            pixels.push_back(pixel);
            grays.push_back(pixel.gray);
            if (!std::isnan(pixel.inverse)) inverses.push_back(pixel.inverse);
        }
    }
    const double of_gray = noise_of(noise(0), grays, LEAST_GRAY_NOISE), of_inverse = noise_of(noise(1), inverses, LEAST_INVERSE_NOISE);
    const std::size_t unknowns = std::tuple_size<Slopes>::value;
    std::vector<double> sums(unknowns * (unknowns + 1), 0.0);
    double gray_loss = 0.0, inverse_loss = 0.0, agreeing = 0.0;
    for (const Pixel& pixel : pixels) {
        gray_loss += add(pixel.gray, pixel.by_gray, of_gray, outlier, sums.data());
        if (!std::isnan(pixel.inverse)) inverse_loss += add(pixel.inverse, pixel.by_inverse, of_inverse, outlier, sums.data());
        agreeing += std::fabs(pixel.gray) <= outlier * of_gray && !(std::fabs(pixel.inverse) > outlier * of_inverse);
    }
    for (std::size_t i = 0; i < unknowns; ++i) {
        for (std::size_t j = 0; j < i; ++j) sums[i * (unknowns + 1) + j] = sums[j * (unknowns + 1) + i];
    }
    std::vector<double> summary{of_gray, of_inverse, gray_loss, inverse_loss, double(known), double(pixels.size()), agreeing};
    return std::make_pair(rows_of(std::move(sums), unknowns + 1), std::move(summary));
}

}  // namespace

void bind_view_alignment(Module& m) {
    // Return the normal equations of the motion between two views of a scene, by brightness and inverse depth.
    //
    // A pixel of the first view with depth is moved by the pose, and compared with the second view there: its brightness, after
    // gain and offset, and its inverse depth. Residuals are weighted by Geman and McClure's estimator, in shares of their noise.
    //
    // Parameters
    // ----------
    // from_gray, from_inverse
    //     (H, W) float32, brightness and inverse depth (1/m) of the first view; NaN where unknown
    // to_gray, to_inverse
    //     (H, W) float32, the same of the second view
    // intrinsics
    //     (4,) float64 px: fx, fy, cx, cy of both views
    // pose
    //     (4, 4) float64 m, p_second = pose @ p_first
    // light
    //     (2,) float64, gain and offset of the brightness from the first view to the second
    // noise
    //     (2,) float64, standard deviations of brightness and of inverse depth (1/m) between the views; 0: from the median residual
    // outlier
    //     standard deviations at which a residual weighs a quarter
    //
    // Returns
    // -------
    // equations : (8, 9) float64, symmetric matrix and right side of the change of (turn about x, y, z, rad; shift along x, y, z, m;
    // gain; offset); turn and shift are to be applied to the left of the pose. summary : (7,) float64: noise of the brightness and
    // of inverse depth; sums of the losses of either, in squared standard deviations; number of pixels that are known in the first
    // view, of those that the second view shows, and of those whose residuals weigh a quarter at least.
    m.def("view_alignment", &view_alignment, "from_gray"_array, "from_inverse"_array, "to_gray"_array, "to_inverse"_array,
          "intrinsics"_array, "pose"_array, "light"_array, "noise"_array, "outlier"_a);
}
