// The color of the surface around strands, and the places that differ from it, on images scaled down by 4 and by 8.
#include "between_pixels.h"
#include "lab.h"
#include "mask_runs.h"

#include <limits>

namespace {

constexpr Index CELL = 8;  // px of the frame in a pixel of the smaller image

// Return the index in [0, size) that cv2's border "reflect 101" takes for one beyond.
Index reflected(Index at, Index size) {
    if (size == 1) return 0;
    while (at < 0 || at >= size) at = at < 0 ? -at : 2 * (size - 1) - at;
    return at;
}

// Return which of the CELL x CELL pixels at a place, each row a bit per pixel, are set or within 2 px of one that is.
void widened(const Matrix<bool>& mask, Index top, Index left, Byte (&rows)[CELL]) {
    const Index height = mask.shape(0), width = mask.shape(1), from = std::max<Index>(left - 2, 0), to = std::min(left + CELL + 2, width);
    unsigned bits[CELL + 4] = {};
    for (Index i = 0; i < CELL + 4; ++i) {
        const Index y = top - 2 + i;
        if (y < 0 || y >= height) continue;
        const Byte* row = bytes_of(mask) + y * width;
        for (Index x = first_set(row, from, to); x < to; x = first_set(row, x + 1, to)) bits[i] |= 1u << (x - left + 2);
    }
    for (Index i = 0; i < CELL; ++i) {
        const unsigned all = bits[i] | bits[i + 1] | bits[i + 2] | bits[i + 3] | bits[i + 4];
        rows[i] = Byte(all | all >> 1 | all >> 2 | all >> 3 | all >> 4);
    }
}

// Tell for each pixel of the smaller image whether half of its cell is within 2 px of the mask; the cell is halved three times,
// with the rounding of an image of bytes.
std::vector<Byte> covered_cells(const Matrix<bool>& mask, Index rows, Index columns) {
    std::vector<Byte> covered(rows * columns, 0);
    for (const Run& run : runs_of(bytes_of(mask), mask.shape(0), mask.shape(1))) {
        for (Index row = std::max<Index>(run.row - 2, 0) / CELL; row <= std::min((run.row + 2) / CELL, rows - 1); ++row) {
            const Index first = std::max<Index>(run.start - 2, 0) / CELL, last = std::min((run.end + 1) / CELL, columns - 1);
            for (Index column = first; column <= last; ++column) covered[row * columns + column] = 1;  // perhaps
        }
    }
    for (Index row = 0; row < rows; ++row) {
        for (Index column = 0; column < columns; ++column) {
            Byte bits[CELL];
            if (!covered[row * columns + column]) continue;
            widened(mask, row * CELL, column * CELL, bits);
            int quarter[2][2] = {};
            for (Index v = 0; v < CELL / 2; ++v) {
                for (Index u = 0; u < CELL / 2; ++u) {
                    const int pair = (bits[2 * v] >> 2 * u & 3) * 4 + (bits[2 * v + 1] >> 2 * u & 3);
                    quarter[v / 2][u / 2] += (255 * ((pair & 1) + (pair >> 1 & 1) + (pair >> 2 & 1) + (pair >> 3)) + 2) >> 2;
                }
            }
            int sum = 2;
            for (const auto& pair : quarter) sum += ((pair[0] + 2) >> 2) + ((pair[1] + 2) >> 2);
            covered[row * columns + column] = sum >> 2 >= 128;
        }
    }
    return covered;
}

// Replace the covered pixels of an image by the mean of those that are not in the window around them, if there is one.
void fill_covered(std::vector<Byte>& image, const std::vector<Byte>& covered, Index rows, Index columns, Index window) {
    using Sums = std::array<int, CHANNELS + 1>;  // of the channels, and the number of pixels
    const double share = 1.0 / double(window * window);
    std::vector<Sums> along(rows * columns);
    std::vector<Index> near(columns + window - 1);
    for (Index x = 0; x < Index(near.size()); ++x) near[x] = reflected(x - window / 2, columns);
    for (Index row = 0; row < rows; ++row) {
        Sums sums{};
        const auto add = [&](Index column, int sign) {
            const Index at = row * columns + near[column];
            if (covered[at]) return;
            for (Index k = 0; k < CHANNELS; ++k) sums[k] += sign * image[at * CHANNELS + k];
            sums[CHANNELS] += sign;
        };
        for (Index x = 0; x < window - 1; ++x) add(x, 1);
        for (Index column = 0; column < columns; ++column) {
            add(column + window - 1, 1);
            along[row * columns + column] = sums;
            add(column, -1);
        }
    }
    for (Index i = first_set(covered.data(), 0, rows * columns); i < rows * columns; i = first_set(covered.data(), i + 1, rows * columns)) {
        Sums sums{};
        for (Index dy = -(window / 2); dy <= window / 2; ++dy) {
            const Sums& from = along[reflected(i / columns + dy, rows) * columns + i % columns];
            for (std::size_t k = 0; k < from.size(); ++k) sums[k] += from[k];
        }
        const float bare = float(sums[CHANNELS] * share);
        if (bare * float(window * window) < 1.0f) continue;
        for (Index k = 0; k < CHANNELS; ++k) {
            image[i * CHANNELS + k] = Byte(std::nearbyint(float(sums[k] * share) / std::max(bare, 1e-3f)));
        }
    }
}

// The median in a window around each pixel of a channel, whose border is repeated beyond it. For each value the pixels up to it are
// counted in all windows at once: as many passes as there are values between the least and the greatest.
class WindowMedian {
   public:
    WindowMedian(Index height, Index width, Index window)
        : height(height), width(width), window(window), across(width + window - 1), padded((height + window - 1) * across), columns(across),
          sizes(across), counts(width), found(height * width) {}

    const std::vector<Byte>& operator()(const std::vector<Byte>& image, Index channel) {
        for (Index y = 0; y < height + window - 1; ++y) {
            const Index v = std::min(std::max<Index>(y - window / 2, 0), height - 1);
            for (Index x = 0; x < across; ++x) {
                const Index u = std::min(std::max<Index>(x - window / 2, 0), width - 1);
                padded[y * across + x] = image[(v * width + u) * CHANNELS + channel];
            }
        }
        std::array<Index, 256> up_to{};
        for (const Byte value : padded) ++up_to[value];
        std::fill(found.begin(), found.end(), Byte(0));
        const Index half = window * window / 2, all = Index(padded.size());
        Index below = 0;
        for (int value = 0; value < 255 && all - (below += up_to[value]) > half; ++value) {
            if (below > half) count_up_to(Byte(value));
            else std::transform(found.begin(), found.end(), found.begin(), [](Byte median) { return Byte(median + 1); });
        }
        return found;
    }

   private:
    Index height, width, window, across;
    std::vector<Byte> padded, columns, sizes, counts, found;

    // Raise the median by one where at most half of the window is up to a value; a window has at most 255 pixels.
    void count_up_to(Byte limit) {
        const Byte half = Byte(window * window / 2);
        Byte *column = columns.data(), *sums = sizes.data(), *count = counts.data();
        std::fill(columns.begin(), columns.end(), Byte(0));
        for (Index y = 0; y + 1 < window; ++y) {
            const Byte* row = padded.data() + y * across;
            for (Index x = 0; x < across; ++x) column[x] = Byte(column[x] + Byte(row[x] <= limit));
        }
        for (Index y = 0; y < height; ++y) {
            const Byte *first = padded.data() + y * across, *last = first + (window - 1) * across;
            for (Index x = 0; x < across; ++x) sums[x] = column[x] = Byte(column[x] + Byte(last[x] <= limit));
            for (Index x = 0; x < across; ++x) column[x] = Byte(column[x] - Byte(first[x] <= limit));
            std::fill(counts.begin(), counts.end(), Byte(0));
            for (Index size = 1, done = 0; size <= window; size *= 2) {  // sums of 1, 2, 4, 8 columns
                if (window & size) {
                    for (Index x = 0; x < width; ++x) count[x] = Byte(count[x] + sums[x + done]);
                    done += size;
                }
                for (Index x = 0; x + size < across; ++x) sums[x] = Byte(sums[x] + sums[x + size]);
            }
            Byte* to = found.data() + y * width;
            for (Index x = 0; x < width; ++x) to[x] = Byte(to[x] + Byte(count[x] <= half));
        }
    }
};

// Median of values as NumPy's: the mean of the two in the middle of an even number.
float median(std::vector<float>& values) {
    const auto middle = values.begin() + values.size() / 2;
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2) return *middle;
    return (*std::max_element(values.begin(), middle) + *middle) / 2;
}

// The surface's color interpolated between the pixels of a smaller image, channel by channel.
std::vector<float> interpolated(const std::vector<float>& color, Index height, Index width, Index rows, Index columns) {
    const std::vector<Between> down = positions(rows, height), along = positions(columns, width);
    std::vector<float> wide(CHANNELS * height * columns), result(CHANNELS * rows * columns);
    for (Index row = 0; row < height; ++row) {
        const float* from = color.data() + row * width * CHANNELS;
        for (Index column = 0; column < columns; ++column) {
            const float *left = from + along[column].first * CHANNELS, *right = from + along[column].second * CHANNELS;
            for (Index k = 0; k < CHANNELS; ++k) {
                wide[(k * height + row) * columns + column] = left[k] + along[column].share * (right[k] - left[k]);
            }
        }
    }
    for (Index k = 0; k < CHANNELS; ++k) {
        for (Index row = 0; row < rows; ++row) {
            const float *upper = wide.data() + (k * height + down[row].first) * columns, share = down[row].share;
            const float* lower = wide.data() + (k * height + down[row].second) * columns;
            float* to = result.data() + (k * rows + row) * columns;
            for (Index column = 0; column < columns; ++column) to[column] = upper[column] + share * (lower[column] - upper[column]);
        }
    }
    return result;
}

// Return the median absolute difference of the blurred image from the surface's color at every so many pixels, by channel.
std::array<float, CHANNELS> differences(const Volume<Byte>& color, const std::vector<float>& surface, Index rows, Index columns, Index step) {
    const Index height = color.shape(0), width = color.shape(1);
    const float weights[] = {BLUR[2], BLUR[1], BLUR[0], BLUR[1], BLUR[2]};
    const LabTables& to_lab = lab_tables();
    std::array<std::vector<float>, CHANNELS> away;
    for (Index v = 2; v < height - 2; v += 4 * step) {
        for (Index u = 2; u < width - 2; u += step) {
            float sum[CHANNELS] = {};
            for (Index dx = -2; dx <= 2; ++dx) {
                float down[CHANNELS] = {};
                for (Index dy = -2; dy <= 2; ++dy) {
                    Byte lab[CHANNELS];
                    to_lab(color.data() + ((v + dy) * width + u + dx) * CHANNELS, lab);
                    for (Index k = 0; k < CHANNELS; ++k) down[k] += weights[dy + 2] * float(lab[k]);
                }
                for (Index k = 0; k < CHANNELS; ++k) sum[k] += weights[dx + 2] * down[k];
            }
            for (Index k = 0; k < CHANNELS; ++k) {
                away[k].push_back(std::fabs(sum[k] - surface[(k * rows + v * rows / height) * columns + u * columns / width]));
            }
        }
    }
    return {median(away[0]), median(away[1]), median(away[2])};
}

auto surface_color(Volume<Byte> color, Volume<Byte> lab, Volume<Byte> small, Matrix<bool> raised, Index window, Index step, double per_median,
                   double min_deviation, double grow) {
    const Index rows = lab.shape(0), columns = lab.shape(1), height = small.shape(0), width = small.shape(1);
    require(color.shape(2) == CHANNELS && lab.shape(2) == CHANNELS && small.shape(2) == CHANNELS, "an image is not (H, W, 3)");
    require(color.shape(0) > 4 && color.shape(1) > 4 && rows > 0 && columns > 0 && height > 0 && width > 0, "an image is too small");
    require(raised.shape(0) == color.shape(0) && raised.shape(1) == color.shape(1), "color and raised differ in size");
    require(window > 0 && window % 2 == 1 && window < 16 && step > 0, "window is not odd and below 16, or step not over 0");
    std::vector<float> around(height * width * CHANNELS);
    std::vector<double> deviation(CHANNELS);
    std::vector<Byte> seeds(rows * columns);
    count_visits(rows * columns + height * width);
    count_bytes(Index(raised.size()));
    {
        nb::gil_scoped_release released;
        std::vector<Byte> bare(small.data(), small.data() + around.size());
        fill_covered(bare, covered_cells(raised, height, width), height, width, window);
        WindowMedian median_of(height, width, window);
        for (Index k = 0; k < CHANNELS; ++k) {
            const std::vector<Byte>& found = median_of(bare, k);
            for (Index i = 0; i < height * width; ++i) around[i * CHANNELS + k] = found[i];
        }
        const std::vector<float> surface = interpolated(around, height, width, rows, columns);
        const auto medians = differences(color, surface, rows, columns, step);
        float weights[CHANNELS];
        for (Index k = 0; k < CHANNELS; ++k) {
            deviation[k] = std::max(double(float(per_median) * medians[k]), min_deviation);
            weights[k] = float(1 / (deviation[k] * deviation[k]));
        }
        const Index size = rows * columns;
        for (Index i = 0; i < size; ++i) {
            float contrast = 0.0f;
            for (Index k = 0; k < CHANNELS; ++k) {
                const float away = float(lab.data()[i * CHANNELS + k]) - surface[k * size + i];
                contrast += weights[k] * (away * away);
            }
            seeds[i] = contrast > float(grow * grow);
        }
    }
    nb::capsule owner;
    float* data = release(std::move(around), owner);
    const nb::ndarray<nb::numpy, float, nb::ndim<3>, nb::c_contig> result(data, {std::size_t(height), std::size_t(width), 3}, owner);
    return nb::make_tuple(result, to_numpy(std::move(deviation)), to_numpy_bool(seeds, rows, columns));
}

}  // namespace

void bind_surface_color(nb::module_& m) {
    m.def("surface_color", &surface_color, "color"_a.noconvert(), "lab"_a.noconvert(), "small"_a.noconvert(), "raised"_a.noconvert(),
          "window"_a, "step"_a, "per_median"_a, "min_deviation"_a, "seed"_a);
}
