#include "between_pixels.h"
#include "lab.h"
#include "mask_runs.h"
#include "shrinking.h"

#include <limits>

namespace {

constexpr Index CELL = 8;  // px of the frame in a pixel of the smaller image

// Return the index in [0, size) that cv2's border "reflect 101" takes for one beyond.
Index reflected(Index at, Index size) {
    if (size == 1) return 0;
    while (at < 0 || at >= size) at = at < 0 ? -at : 2 * (size - 1) - at;
    return at;
}

// Return which of the CELL x CELL pixels of a cell, each row a bit per pixel, are set or within 2 px of one that is.
void widened(const BitImage& mask, Index row, Index column, Byte (&rows)[CELL]) {
    unsigned bits[CELL + 4] = {};
    for (Index i = 0; i < CELL + 4; ++i) {
        const Index y = row * CELL - 2 + i;
        if (y < 0 || y >= mask.height) continue;
        const unsigned before = column > 0 ? mask.eight(y, column - 1) : 0;
        const unsigned after = column + 1 < mask.words * Index(sizeof(Word)) ? mask.eight(y, column + 1) : 0;
        bits[i] = before >> (CELL - 2) | unsigned(mask.eight(y, column)) << 2 | after << (CELL + 2);
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
    BitImage bits(mask.shape(0), mask.shape(1));
    for (const Run& run : runs_of(bytes_of(mask), mask.shape(0), mask.shape(1))) {
        bits.set_run(run.row, run.start, run.end);
        for (Index row = std::max<Index>(run.row - 2, 0) / CELL; row <= std::min((run.row + 2) / CELL, rows - 1); ++row) {
            const Index first = std::max<Index>(run.start - 2, 0) / CELL, last = std::min((run.end + 1) / CELL, columns - 1);
            for (Index column = first; column <= last; ++column) covered[row * columns + column] = 1;  // perhaps
        }
    }
    for (Index row = 0; row < rows; ++row) {
        for (Index column = 0; column < columns; ++column) {
            Byte near[CELL];
            if (!covered[row * columns + column]) continue;
            widened(bits, row, column, near);
            int quarter[2][2] = {};
            for (Index v = 0; v < CELL / 2; ++v) {
                for (Index u = 0; u < CELL / 2; ++u) {
                    const int pair = (near[2 * v] >> 2 * u & 3) * 4 + (near[2 * v + 1] >> 2 * u & 3);
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

// Add one to each sum whose value is up to a limit.
inline void add_up_to(const Byte* __restrict values, Byte limit, Index count, Byte* __restrict sums) {
    for (Index x = 0; x < count; ++x) sums[x] = Byte(sums[x] + Byte(values[x] <= limit));
}

inline void add(const Byte* __restrict values, Index count, Byte* __restrict sums) {
    for (Index x = 0; x < count; ++x) sums[x] = Byte(sums[x] + values[x]);
}

inline void add_beside(const Byte* __restrict values, Index step, Index count, Byte* __restrict sums) {
    for (Index x = 0; x < count; ++x) sums[x] = Byte(values[x] + values[x + step]);
}

// Count the last row of a window in each column, copy the counts, and take its first row away.
inline void move_down(const Byte* __restrict first, const Byte* __restrict last, Byte limit, Index count, Byte* __restrict columns,
                      Byte* __restrict counts) {
    for (Index x = 0; x < count; ++x) {
        const Byte here = Byte(columns[x] + Byte(last[x] <= limit));
        counts[x] = here;
        columns[x] = Byte(here - Byte(first[x] <= limit));
    }
}

// Tell for each window of an image (height, width), which is padded by half a window on all sides, whether at most half of its pixels
// are up to a value: 1 or 0. `rows` is for four rows of the padded image.
WITH_AVX2 void find_above(const Byte* __restrict padded, Index height, Index width, Index window, Byte limit, Byte* __restrict rows,
                          Byte* __restrict above) {
    const Index across = width + window - 1;
    Byte *columns = rows, *counts = rows + across, *sums = counts + across, *wider = sums + across;
    std::memset(columns, 0, std::size_t(across));
    for (Index y = 0; y + 1 < window; ++y) add_up_to(padded + y * across, limit, across, columns);
    for (Index y = 0; y < height; ++y) {
        const Byte* first = padded + y * across;
        move_down(first, first + (window - 1) * across, limit, across, columns, sums);
        std::memset(counts, 0, std::size_t(width));
        for (Index size = 1, done = 0; size <= window; size *= 2) {  // sums of 1, 2, 4, 8 columns
            if (window & size) {
                add(sums + done, width, counts);
                done += size;
            }
            if (2 * size <= window) add_beside(sums, size, across - size, wider);
            std::swap(sums, wider);
        }
        for (Index x = 0; x < width; ++x) above[y * width + x] = Byte(counts[x] <= Byte(window * window / 2));
    }
}

// Return the number of ones among bytes of 0 and 1.
Index number_of(const std::vector<Byte>& flags) {
    Index number = 0;
    for (std::size_t start = 0; start < flags.size(); start += 255) {
        Byte some = 0;
        for (std::size_t i = start; i < std::min(start + 255, flags.size()); ++i) some = Byte(some + flags[i]);
        number += some;
    }
    return number;
}

// The median in a window around each pixel of a channel, whose border is repeated beyond it. For each value the pixels up to it are
// counted in all windows at once: as many passes as there are values between the least and the greatest median.
class WindowMedian {
   public:
    WindowMedian(Index height, Index width, Index window)
        : height(height), width(width), window(window), across(width + window - 1), padded((height + window - 1) * across), rows(4 * across),
          above(height * width), found(height * width) {}

    const std::vector<Byte>& operator()(const std::vector<Byte>& image, Index channel) {
        for (Index y = 0; y < height + window - 1; ++y) {
            const Index v = std::min(std::max<Index>(y - window / 2, 0), height - 1);
            for (Index x = 0; x < across; ++x) {
                const Index u = std::min(std::max<Index>(x - window / 2, 0), width - 1);
                padded[y * across + x] = image[(v * width + u) * CHANNELS + channel];
            }
        }
        // the medians lie between the values that half a window of pixels are not above, and not below
        std::array<Index, 256> up_to{};
        for (const Byte value : padded) ++up_to[value];
        const Index half = window * window / 2;
        int least = 0, most = 255;
        for (Index below = up_to[0]; below <= half; below += up_to[++least]) {}
        for (Index above = up_to[255]; above <= half; above += up_to[--most]) {}
        while (least < most) {  // the least median
            const int value = (least + most) / 2;
            number_above(value) < height * width ? most = value : least = value + 1;
        }
        std::fill(found.begin(), found.end(), Byte(least));
        for (; number_above(least) > 0; ++least) add(above.data(), height * width, found.data());
        return found;
    }

   private:
    Index height, width, window, across;
    std::vector<Byte> padded, rows, above, found;

    // Find the windows with a median above a value, and return their number; a window has at most 255 pixels.
    Index number_above(int value) {
        find_above(padded.data(), height, width, window, Byte(value), rows.data(), above.data());
        return number_of(above);
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
    const Index side = std::size(weights);
    std::vector<Byte> lab;  // of the pixels around the samples, row by row
    for (Index v = 2; v < height - 2; v += 4 * step) {
        for (Index u = 2; u < width - 2; u += step) {
            for (Index dy = -2; dy <= 2; ++dy) {
                const Byte* from = color.data() + ((v + dy) * width + u - 2) * CHANNELS;
                lab.insert(lab.end(), from, from + side * CHANNELS);
            }
        }
    }
    lab_tables().convert(lab.data(), lab.size() / CHANNELS);
    std::array<std::vector<float>, CHANNELS> away;
    const Byte* from = lab.data();
    for (Index v = 2; v < height - 2; v += 4 * step) {
        for (Index u = 2; u < width - 2; u += step, from += side * side * CHANNELS) {
            for (Index k = 0; k < CHANNELS; ++k) {
                float sum = 0.0f;
                for (Index dx = 0; dx < side; ++dx) {
                    float down = 0.0f;
                    for (Index dy = 0; dy < side; ++dy) down += weights[dy] * float(from[(dy * side + dx) * CHANNELS + k]);
                    sum += weights[dx] * down;
                }
                away[k].push_back(std::fabs(sum - surface[(k * rows + v * rows / height) * columns + u * columns / width]));
            }
        }
    }
    return {median(away[0]), median(away[1]), median(away[2])};
}

// Tell for each pixel of a smaller image whether it differs from the surface's color, a channel after the other.
WITH_AVX2 void find_seeds(const Byte* __restrict lab, const float* __restrict surface, const float* weights, float limit, Index size,
                          Byte* __restrict seeds) {
    const float *light = surface, *a = light + size, *b = a + size;
    for (Index i = 0; i < size; ++i) {
        const float x = float(lab[CHANNELS * i]) - light[i], y = float(lab[CHANNELS * i + 1]) - a[i], z = float(lab[CHANNELS * i + 2]) - b[i];
        float contrast = 0.0f;
        contrast += weights[0] * (x * x);
        contrast += weights[1] * (y * y);
        contrast += weights[2] * (z * z);
        seeds[i] = contrast > limit;
    }
}

auto surface_color(Volume<Byte> color, Matrix<bool> raised, Index window, Index step, double per_median, double min_deviation, double grow) {
    require(color.shape(2) == CHANNELS, "color is not (H, W, 3)");
    require(color.shape(0) > 4 && color.shape(1) > 4, "color is too small");
    require(raised.shape(0) == color.shape(0) && raised.shape(1) == color.shape(1), "color and raised differ in size");
    require(window > 0 && window % 2 == 1 && window < 16 && step > 0, "window is not odd and below 16, or step not over 0");
    std::vector<float> around;
    std::vector<double> deviation(CHANNELS);
    std::vector<Byte> seeds;
    Index rows = 0, columns = 0, height = 0, width = 0;
    {
        nb::gil_scoped_release released;
        Colors lab = quartered(color.data(), color.shape(0), color.shape(1));
        lab_tables().convert(lab.bytes.data(), lab.bytes.size() / CHANNELS);
        Colors bare = halved(lab.bytes.data(), lab.height, lab.width);
        rows = lab.height, columns = lab.width, height = bare.height, width = bare.width;
        fill_covered(bare.bytes, covered_cells(raised, height, width), height, width, window);
        around.resize(bare.bytes.size());
        WindowMedian median_of(height, width, window);
        for (Index k = 0; k < CHANNELS; ++k) {
            const std::vector<Byte>& found = median_of(bare.bytes, k);
            for (Index i = 0; i < height * width; ++i) around[i * CHANNELS + k] = found[i];
        }
        const std::vector<float> surface = interpolated(around, height, width, rows, columns);
        const auto medians = differences(color, surface, rows, columns, step);
        float weights[CHANNELS];
        for (Index k = 0; k < CHANNELS; ++k) {
            deviation[k] = std::max(double(float(per_median) * medians[k]), min_deviation);
            weights[k] = float(1 / (deviation[k] * deviation[k]));
        }
        seeds.resize(rows * columns);
        find_seeds(lab.bytes.data(), surface.data(), weights, float(grow * grow), rows * columns, seeds.data());
    }
    nb::capsule owner;
    float* data = release(std::move(around), owner);
    const nb::ndarray<nb::numpy, float, nb::ndim<3>, nb::c_contig> result(data, {std::size_t(height), std::size_t(width), 3}, owner);
    return std::make_tuple(result, to_numpy(std::move(deviation)), to_numpy_bool(seeds, rows, columns));
}

}  // namespace

void bind_surface_color(Module& m) {
    // Return the color of the surface around strands, its deviation, and the places that differ from it.
    //
    // Colors are compared in OpenCV's 8-bit CIELAB, in images scaled down by halves: by 4, and by 8. The surface's color is the
    // median in a window of the smaller one. There, pixels mostly within 2 px of raised ones are replaced by the mean of the others
    // in the window, so that a coil is none.
    //
    // Parameters
    // ----------
    // color
    //     (H, W, 3) uint8 RGB, H and W over 4.
    // raised
    //     (H, W) bool.
    // window
    //     px of the smaller image, odd and at most 15.
    // step
    //     px between the samples of the image along a row, and a quarter of that between rows.
    // per_median
    //     standard deviations per median absolute deviation.
    // min_deviation
    //     deviation at least.
    // seed
    //     deviations from which on a pixel of the larger image differs.
    //
    // Returns
    // -------
    // around : (h, w, 3) float32, the surface's color in the smaller image.
    // deviation : (3,), robust standard deviation of the image, blurred by a Gaussian of 0.8 px, from the surface's color.
    // seeds : (r, c) bool, the pixels of the larger image that differ.
    m.def("surface_color", &surface_color, "color"_a.noconvert(), "raised"_a.noconvert(), "window"_a, "step"_a, "per_median"_a,
          "min_deviation"_a, "seed"_a);
}
