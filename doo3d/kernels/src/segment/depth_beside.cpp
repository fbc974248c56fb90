// Depth of what is seen on both sides of one strand.
#include "image.h"
#include "order_statistics.h"
#include "polyline.h"
#include "strand_smoothing.h"
#include "whittaker.h"

namespace {

using Series = std::vector<double>;

// Return the unit direction across a line of pixels at each of them, u and v in turn: the mean of 9 steps along it, turned.
Series across(const Matrix<Index>& line) {
    const Index count = line.shape(0);
    Series along[2] = {Series(count), Series(count)}, turned;
    for (Index d = 0; d < 2; ++d) {
        for (Index i = 0; i < count; ++i) {
            const Index before = std::max<Index>(i - 1, 0), after = std::min(i + 1, count - 1);
            along[d][i] = double(line(after, d) - line(before, d)) / double(after - before);
        }
        along[d] = running_mean(along[d], 4);
    }
    for (Index i = 0; i < count; ++i) {
        const double u = along[0][i], v = along[1][i], square = u * u + v * v, norm = square > 0 ? std::sqrt(square) : 1.0;
        turned.insert(turned.end(), {-(v / norm), u / norm});
    }
    return turned;
}

// Return the median reading on both sides of each sample; NaN where there are none.
Series medians_beside(const Matrix<Index>& line, const Vector<double>& reach, const Vector<double>& beyond, const MaskedDepth& depth) {
    const Series directions = across(line);
    Series medians;
    std::vector<float> readings;
    for (Index i = 0; i < Index(line.shape(0)); ++i) {
        readings.clear();
        for (std::size_t k = 0; k < 2 * beyond.shape(0); ++k) {
            const double offset = (k % 2 ? 1.0 : -1.0) * (reach(i) + beyond(k / 2));
            const double u = double(line(i, 0)) + offset * directions[2 * i], v = double(line(i, 1)) + offset * directions[2 * i + 1];
            const float reading = depth.at(u, v, false);
            if (!std::isnan(reading)) readings.push_back(reading);
        }
        medians.push_back(readings.empty() ? std::nan("") : double(median(readings)));
    }
    return medians;
}

auto smooth_depth_beside(Matrix<Index> line, Vector<double> reach, Vector<double> beyond, Matrix<bool> mask, Matrix<float> depth,
                         double strength) {
    const Index count = line.shape(0);
    require(count >= 2 && line.shape(1) == 2, "line is not (S, 2) with at least two samples");
    require(Index(reach.shape(0)) == count, "reach is not one per sample");
    const MaskedDepth masked{depth, mask};
    masked.check();
    count_visits(count * (2 * Index(beyond.shape(0)) + SMOOTHINGS));
    const Series medians = medians_beside(line, reach, beyond, masked);
    std::vector<Index> known;
    for (Index i = 0; i < count; ++i) {
        if (!std::isnan(medians[i])) known.push_back(i);
    }
    Series smooth;
    if (known.empty() || 2 * Index(known.size()) < count) return smooth;
    const Series surface = interpolated([&](Index i) { return medians[i]; }, count, known);
    Series weight(count, 1.0), residual(count);
    for (Index round = 0; round < SMOOTHINGS; ++round) {
        smooth = whittaker(surface.data(), weight.data(), count, 1, strength, 2);
        for (Index i = 0; i < count; ++i) residual[i] = surface[i] - smooth[i];
        const double cut = std::max(2 * (MAD_TO_DEVIATION * absolute_median(residual)), 1e-6);
        for (Index i = 0; i < count; ++i) weight[i] = 1 / (1 + (residual[i] / cut) * (residual[i] / cut));
    }
    return smooth;
}

}  // namespace

void bind_depth_beside(Module& m) {
    // Return the smooth depth of what is seen on both sides of a strand: the medians across it, then a robust Whittaker smoother.
    //
    // Parameters
    // ----------
    // line
    //     (S, 2) int64 px (u, v), S >= 2 samples along the strand, a pixel apart
    // reach
    //     (S,) px, radius of the strand at each sample
    // beyond
    //     (A,) px, distances from either side of the strand at which the depth is read
    // mask
    //     (H, W) bool, the pixels that are not beside the strand, since they are of the object
    // depth
    //     (H, W) float32 m, 0 = no reading
    // strength
    //     weight of smoothness, as of `whittaker_smooth`
    //
    // Returns
    // -------
    // (S,) m; (0,) if less than half of the samples have a reading beside them.
    m.def("smooth_depth_beside", &smooth_depth_beside, "line"_array, "reach"_array, "beyond"_array, "mask"_array, "depth"_array,
          "strength"_a);
}
