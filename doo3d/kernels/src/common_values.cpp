// The values that many measurements have in common: the half-width of a strand, and the hues of an object.
#include "arrays.h"

#include <algorithm>

namespace {

double usual_half_width(Vector<float> half_width, double least, double bin, double min_share) {
    require(least > 0 && bin > 1e-3 && min_share >= 0, "least and bin are not positive, or the share is negative");
    std::vector<double> logs;
    count_visits(Index(half_width.shape(0)));
    for (std::size_t k = 0; k < half_width.shape(0); ++k) {
        const double width = double(half_width(k));
        require(width < 1e9, "a half-width is not finite");
        if (width >= least) logs.push_back(std::log(width));
    }
    if (logs.empty()) return 0.0;
    const double first = std::log(least), highest = *std::max_element(logs.begin(), logs.end());
    const Index bins = Index(std::ceil((highest + 4 * bin - first) / bin)) - 1;
    std::vector<double> count(bins), near(bins);
    for (const double value : logs) count[std::min(std::max<Index>(Index((value - first) / bin), 0), bins - 1)] += 1;
    for (Index k = 0; k < bins; ++k) {
        for (Index j = std::max<Index>(k - 2, 0); j < std::min(k + 3, bins); ++j) near[k] += count[j];
    }
    for (Index k = 0; k < bins; ++k) {
        if (near[k] < min_share * double(logs.size())) continue;
        if (near[k] < *std::max_element(near.begin() + std::max<Index>(k - 4, 0), near.begin() + std::min(k + 5, bins))) continue;
        double sum = 0.0;
        for (Index j = std::max<Index>(k - 2, 0); j < std::min(k + 3, bins); ++j) sum += count[j] * (first + (double(j) + 0.5) * bin);
        return std::exp(sum / near[k]);
    }
    return 0.0;
}

// A histogram on a circle, smoothed by a Gaussian.
std::vector<double> smoothed_circle(const std::vector<double>& count, double deviation) {
    const Index bins = Index(count.size());
    std::vector<double> kernel(bins), result(bins);
    double total = 0.0;
    for (Index k = 0; k < bins; ++k) total += kernel[k] = std::exp(-std::pow(double(k - bins / 2) / deviation, 2) / 2);
    for (Index i = 0; i < bins; ++i) {
        for (Index j = 0; j < bins; ++j) result[i] += kernel[(i - j + bins / 2 + bins) % bins] * count[j];
        result[i] /= total;
    }
    return result;
}

double highest_between(const std::vector<double>& height, Index first, Index end) {
    double highest = 0.0;
    const Index bins = Index(height.size()), last = end > first ? end : end + bins;
    for (Index k = first; k < last; ++k) highest = std::max(highest, height[k % bins]);
    return highest;
}

// Modes are joined across their highest saddle, relative to the lower mode, until every saddle is low. Returned are the bins at which
// the modes begin.
std::vector<Index> mode_cuts(const std::vector<double>& height, double max_saddle) {
    const Index bins = Index(height.size());
    std::vector<Index> cuts;
    for (Index k = 0; k < bins; ++k) {
        if (height[k] < height[(k + bins - 1) % bins] && height[k] <= height[(k + 1) % bins]) cuts.push_back(k);
    }
    while (cuts.size() > 1) {
        const std::size_t number = cuts.size();
        std::vector<double> peak(number);
        for (std::size_t k = 0; k < number; ++k) peak[k] = highest_between(height, cuts[k], cuts[(k + 1) % number]);
        std::size_t worst = 0;
        double highest = -1.0;
        for (std::size_t k = 0; k < number; ++k) {
            const double saddle = height[cuts[k]] / std::min(peak[(k + number - 1) % number], peak[k]);
            if (saddle < highest || (saddle == highest && height[cuts[k]] <= height[cuts[worst]])) continue;
            worst = k;
            highest = saddle;
        }
        if (highest <= max_saddle) break;
        cuts.erase(cuts.begin() + std::ptrdiff_t(worst));
    }
    return cuts;
}

auto hue_modes(Vector<Index> hue, Vector<float> weight, Index bins, double deviation, double max_saddle) {
    require(hue.shape(0) == weight.shape(0), "weights are not one per hue");
    require(bins > 0 && bins <= 4096 && deviation > 0, "bins are not from 1 to 4096, or the deviation is not positive");
    count_visits(Index(hue.shape(0)) + bins * bins);
    ReleasedGil released;
    std::vector<double> count(bins);
    for (std::size_t k = 0; k < hue.shape(0); ++k) {
        require(hue(k) >= 0 && hue(k) < bins && weight(k) >= 0, "a hue is no bin, or its weight is negative");
        count[hue(k)] += double(weight(k));
    }
    std::vector<Index> number(bins);
    const std::vector<double> height = smoothed_circle(count, deviation);
    if (*std::max_element(height.begin(), height.end()) > 0) {
        const std::vector<Index> cuts = mode_cuts(height, max_saddle);
        for (Index k = 0; k < bins; ++k) {
            number[k] = std::upper_bound(cuts.begin(), cuts.end(), k) - cuts.begin();
            if (number[k] == 0) number[k] = std::max<Index>(Index(cuts.size()), 1);
        }
    }
    released.end();
    return to_numpy(std::move(number));
}

}  // namespace

void bind_common_values(Module& m) {
    // Return the least half-width that a good part of a medial axis has; 0 if there is none.
    //
    // Parameters
    // ----------
    // half_width
    //     (K,) float32 px, half-widths at the pixels of the medial axis
    // least
    //     px; thinner parts do not count
    // bin
    //     width of the bins of the logarithm of half-widths; five in a row hold one width
    // min_share
    //     share of the pixels that a half-width needs
    m.def("usual_half_width", &usual_half_width, "half_width"_a.noconvert(), "least"_a, "bin"_a, "min_share"_a);
    // Return the number of the mode, from 1, of each bin of a histogram on a circle, (bins,) int64; 0 everywhere if it is empty.
    //
    // Modes are joined across their highest saddle until every saddle is low.
    //
    // Parameters
    // ----------
    // hue
    //     (N,) int64, bins
    // weight
    //     (N,) float32, not below 0
    // bins
    //     number of bins, at most 4096
    // deviation
    //     bins, standard deviation of the Gaussian by which the histogram is smoothed
    // max_saddle
    //     height of the saddle between two modes over that of the lower, up to which they are two
    m.def("hue_modes", &hue_modes, "hue"_a.noconvert(), "weight"_a.noconvert(), "bins"_a, "deviation"_a, "max_saddle"_a);
}
