#include "appearance.h"

namespace {

using Histogram = std::vector<double>;  // of color_cells() cells

// Sum by halves down to 128 values, those in eight lanes: the order of NumPy, whose error grows with the logarithm of the size.
double pairwise_sum(const double* values, Index size) {
    if (size > 128) return pairwise_sum(values, size / 2) + pairwise_sum(values + size / 2, size / 2);
    std::array<double, 8> lane;
    std::copy(values, values + lane.size(), lane.begin());
    for (Index i = lane.size(); i < size; ++i) lane[i % lane.size()] += values[i];
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

// Convolve a histogram along one axis with a symmetric kernel, half of which is given, the middle first; edge cells are repeated.
Histogram smoothed(const Histogram& from, Index step, const std::vector<double>& half) {
    Histogram to(from.size());
    const Index size = step * COLOR_LEVELS;
    Visits visits{color_cells()};
    for (Index start = 0; start < color_cells(); start += size) {
        if (std::all_of(&from[start], &from[start] + size, [](double count) { return count == 0; })) continue;  // few colors are seen
        visits.count += size * (Index(half.size()) - 1);
        for (Index i = 0; i < COLOR_LEVELS; ++i) {
            double* out = &to[start + i * step];
            const double* middle = &from[start + i * step];
            for (Index j = 0; j < step; ++j) out[j] = middle[j] * half[0];
            for (Index k = Index(half.size()) - 1; k > 0; --k) {
                const double* before = &from[start + std::max<Index>(i - k, 0) * step];
                const double* after = &from[start + std::min(i + k, COLOR_LEVELS - 1) * step];
                for (Index j = 0; j < step; ++j) out[j] += (before[j] + after[j]) * half[k];
            }
        }
    }
    return to;
}

// Return the smoothed frequencies of the cells, none of them 0, and add the squares of their relative errors to `variance`.
Histogram frequencies(Histogram counts, const std::vector<double>& half, double least, Histogram& variance) {
    for (Index step = color_cells() / COLOR_LEVELS; step; step /= COLOR_LEVELS) counts = smoothed(counts, step, half);
    const double sum = std::max(pairwise_sum(counts.data(), color_cells()), 1e-9);
    const double unseen = 1 / (least * sum);
    for (Index i = 0; i < color_cells(); ++i) {
        const bool is_seen = counts[i] != 0;
        counts[i] = is_seen ? counts[i] / sum + least : least;
        variance[i] += is_seen ? 1 / (counts[i] * sum) : unseen;
    }
    return counts;
}

// Return the median, over the pixels counted, of the values of their cells; with an even number the mean of the middle two.
float median_of(const std::vector<float>& values, const Histogram& counts) {
    std::vector<std::pair<float, double>> cells;
    double total = 0.0;
    for (Index i = 0; i < color_cells(); ++i) {
        if (counts[i] > 0) cells.emplace_back(values[i], counts[i]);
        total += counts[i];
    }
    if (cells.empty()) return 0.0f;
    std::sort(cells.begin(), cells.end());
    const auto at = [&](double rank) {  // from 0
        std::size_t i = 0;
        for (double seen = cells[0].second; seen <= rank; seen += cells[i].second) ++i;
        return cells[i].first;
    };
    return (at(std::floor((total - 1) / 2)) + at(std::floor(total / 2))) / 2;
}

// Return the weights of a Gaussian of some cells, the middle one and those to one side up to four deviations.
std::vector<double> half_gaussian(double deviation) {
    std::vector<double> half(std::size_t(4 * deviation + 0.5) + 1);
    double sum = 0.0;
    for (std::size_t i = 0; i < half.size(); ++i) {
        half[i] = std::exp(-0.5 / (deviation * deviation) * double(i * i));
        sum += i ? 2 * half[i] : half[i];
    }
    for (double& weight : half) weight /= sum;
    return half;
}

struct Shades {
    std::vector<std::array<Byte, 256>> dimmed;  // each value of a channel in each shade
    explicit Shades(const Vector<double>& shades) : dimmed(shades.shape(0)) {
        for (std::size_t k = 0; k < dimmed.size(); ++k) {
            for (Index value = 0; value < 256; ++value) dimmed[k][value] = Byte(double(value) * shades(k));
        }
    }
};

// Count the colors of the surround: each as seen, and as a share of it in each shade.
Histogram count_surround(const Byte* color, const Vector<std::int64_t>& pixels, const Shades& shades, double share) {
    Histogram seen(color_cells(), 0.0), shaded(color_cells(), 0.0);
    count_visits(Index(pixels.shape(0)) * Index(1 + shades.dimmed.size()));
    for (std::size_t i = 0; i < pixels.shape(0); ++i) {
        const Byte* rgb = color + CHANNELS * pixels(i);
        ++seen[color_cell(rgb)];
        for (const auto& dimmed : shades.dimmed) {
            const Byte darker[] = {dimmed[rgb[0]], dimmed[rgb[1]], dimmed[rgb[2]]};
            ++shaded[color_cell(darker)];
        }
    }
    for (Index i = 0; i < color_cells(); ++i) seen[i] += share * shaded[i];
    return seen;
}

void check_pixels(const Vector<std::int64_t>& pixels, const Volume<Byte>& color) {
    const Index size = color.shape(0) * color.shape(1);
    for (std::size_t i = 0; i < pixels.shape(0); ++i) require(pixels(i) >= 0 && pixels(i) < size, "a pixel lies outside of the image");
}

class ColorOdds {
   public:
    ColorOdds(Volume<Byte> image, Vector<std::int64_t> object, Vector<std::int64_t> surround, Vector<double> shades, double shade_share,
              double smoothing, double least)
        : color(std::move(image)), odds(color_cells()), variance(color_cells(), 0.0) {
        require(color.shape(2) == CHANNELS, "color has to be (H, W, 3)");
        require(smoothing > 0 && smoothing < double(COLOR_LEVELS), "smoothing is not between 0 and 16 cells");
        for (std::size_t k = 0; k < shades.shape(0); ++k) require(shades(k) >= 0 && shades(k) <= 1, "a shade is not between 0 and 1");
        check_pixels(object, color);
        check_pixels(surround, color);
        const std::vector<double> kernel = half_gaussian(smoothing);
        Histogram counts(color_cells(), 0.0);
        count_visits(Index(object.shape(0)));
        for (std::size_t i = 0; i < object.shape(0); ++i) ++counts[color_cell(color.data() + CHANNELS * object(i))];
        const Histogram ours = frequencies(counts, kernel, least, variance);
        const Histogram theirs =
            frequencies(count_surround(color.data(), surround, Shades(shades), shade_share), kernel, least, variance);
        for (Index i = 0; i < color_cells(); ++i) odds[i] = ours[i] == theirs[i] ? 0.0f : float(std::log(ours[i] / theirs[i]));
        separation = median_of(odds, counts);
    }

    float separation;
    std::vector<float> log_odds() const { return odds; }
    auto log_odds_at(StridedMatrix<std::int64_t> pixels) const { return at(pixels, [&](Index cell) { return odds[cell]; }); }
    auto noise_at(StridedMatrix<std::int64_t> pixels) const { return at(pixels, [&](Index cell) { return float(std::sqrt(variance[cell])); }); }

   private:
    Volume<Byte> color;
    std::vector<float> odds;  // of each cell
    Histogram variance;       // of the log-odds of each cell

    template <class OfCell>
    std::vector<double> at(const StridedMatrix<std::int64_t>& pixels, OfCell of_cell) const {
        require(pixels.shape(1) == 2, "pixels are not (N, 2)");
        const Index height = color.shape(0), width = color.shape(1);
        std::vector<double> values(pixels.shape(0));
        count_visits(Index(values.size()));
        for (std::size_t i = 0; i < values.size(); ++i) {
            const Index u = pixels(i, 0), v = pixels(i, 1);
            require(u >= 0 && v >= 0 && u < width && v < height, "a pixel lies outside of the image");
            values[i] = of_cell(color_cell(color.data() + CHANNELS * (v * width + u)));
        }
        return values;
    }
};

}  // namespace

void bind_appearance(Module& m) {
    // The log-odds that a color is of an object and not of its surround, from two color histograms of 16 levels per channel.
    //
    // Parameters
    // ----------
    // color
    //     (H, W, 3) uint8 RGB; it is not copied, and must not change.
    // object, surround
    //     (N,) and (K,) int64, row-major indices of pixels of the object and of its surround.
    // shades
    //     (S,) 0 to 1; the surround's colors in each of these shades, truncated to whole values, count too.
    // shade_share
    //     the weight of a color in a shade; that of a color as seen is 1.
    // smoothing
    //     cells, standard deviation of the Gaussian by which the histograms are smoothed along each axis; cells at the border are
    //     repeated.
    // least
    //     frequency added to that of each cell, so that none is 0.
    Class<ColorOdds>(m, "ColorOdds")
        .def(nb::init<Volume<Byte>, Vector<std::int64_t>, Vector<std::int64_t>, Vector<double>, double, double, double>(), "color"_array,
             "object"_array, "surround"_array, "shades"_array, "shade_share"_a, "smoothing"_a, "least"_a)
        // The log-odds, (4096,) float32 nat, of the cells of colors: 16 levels per channel, the blue one last.
        .def_prop_ro("log_odds", &ColorOdds::log_odds)
        // The median, nat, of the log-odds over the pixels of the object; 0 without any.
        .def_ro("separation", &ColorOdds::separation)
        // Return the log-odds, (N,) nat, of the colors at pixels (N, 2) int64 (u, v) in the image: positive on the object.
        .def("log_odds_at", &ColorOdds::log_odds_at, "pixels"_array)
        // Return the standard deviations, (N,) nat, of the log-odds at pixels (N, 2) int64 (u, v) in the image.
        //
        // They are sqrt(1/a + 1/b) for a and b pixels of object and surround in the smoothed cell of a color.
        .def("noise_at", &ColorOdds::noise_at, "pixels"_array);
}
