// How much a place in an image looks like the middle of a horizontal ribbon: uniform along its length, and unlike both sides.
#include "arrays.h"

#include <algorithm>

// Loops over rows are compiled twice where glibc chooses one, for processors with wider vectors too; the numbers are the same.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define DOO3D_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define DOO3D_WIDE_VECTORS
#endif

namespace {

constexpr Index PLANES = CHANNELS + 1, STRIP = 128;  // the channels, and the sum of their squares; columns at a time

// Write the means over a window that moves along a row of pixels of PLANES numbers; `sums` are those of the window at the first.
DOO3D_WIDE_VECTORS void average_along(const float* row, Index window, Index count, float share, double* sums, float* means) {
    double sum[PLANES];
    for (Index k = 0; k < PLANES; ++k) sum[k] = sums[k];
    for (Index x = 0; x < count; ++x) {
        const float *last = row + x * PLANES, *next = last + window * PLANES;
        for (Index k = 0; k < PLANES; ++k) means[x * PLANES + k] = float(sum[k]) * share;
        for (Index k = 0; k < PLANES; ++k) sum[k] += double(next[k]) - double(last[k]);
    }
    for (Index k = 0; k < PLANES; ++k) sums[k] = sum[k];
}

// Write the variance in the window, and after it the means plane by plane.
DOO3D_WIDE_VECTORS void spread_planes(const float* means, float* planes) {
    for (Index x = 0; x < STRIP; ++x) {
        const float a = means[4 * x], b = means[4 * x + 1], c = means[4 * x + 2], square = means[4 * x + 3];
        planes[x] = std::max(square - (a * a + b * b + c * c), 0.0f);
        planes[STRIP + x] = a;
        planes[2 * STRIP + x] = b;
        planes[3 * STRIP + x] = c;
        planes[4 * STRIP + x] = square;
    }
}

DOO3D_WIDE_VECTORS void move_window(float* sums, const float* leaves, const float* enters) {
    for (Index i = 0; i < PLANES * STRIP; ++i) sums[i] = (sums[i] - leaves[i]) + enters[i];
}

// The score of a pixel is the mean squared difference between the ribbon's color and the pixels of one side, of the side that
// differs less, over the variance along the ribbon plus `noise`.
DOO3D_WIDE_VECTORS void score_row(const float* i0, const float* a0, const float* b0, float in, float out, float noise, std::int32_t index,
                                  float* best, std::int32_t* which) {
    for (Index x = 0; x < STRIP; ++x) {
        const float r = i0[x + STRIP] * in, g = i0[x + 2 * STRIP] * in, b = i0[x + 3 * STRIP] * in, spread = i0[x] * in;
        const float own = r * r + g * g + b * b;
        const float up = a0[x + 3 * STRIP] * out - 2 * out * (a0[x] * r + a0[x + STRIP] * g + a0[x + 2 * STRIP] * b) + own;
        const float down = b0[x + 3 * STRIP] * out - 2 * out * (b0[x] * r + b0[x + STRIP] * g + b0[x + 2 * STRIP] * b) + own;
        const float value = (up < down ? up : down) / ((spread > 0.0f ? spread : 0.0f) + noise);
        which[x] = value > best[x] ? index : which[x];
        best[x] = value > best[x] ? value : best[x];
    }
}

// The rows of a strip averaged along one window, the last of them kept; rows beyond the image repeat the outermost one.
struct AveragedRows {
    Index half, reach = 0;         // of the window along the row, and how many rows from the middle one are looked at
    std::vector<double> sums;      // of each row, of the window at the strip's first column
    std::vector<float> kept;
    Index next = 0;

    const float* at(Index row, Index height) const {
        const Index inside = std::min(std::max<Index>(row, 0), height - 1);
        return kept.data() + inside % (2 * reach + 3) * (PLANES + 1) * STRIP;
    }
};

// Sums of averaged rows over the rows of a window, of PLANES planes from `plane` on.
struct RowWindow {
    Index first, last, plane;  // rows of the window around row 0
    std::vector<float> sums;

    void start(const AveragedRows& rows, Index height) {
        sums.assign(PLANES * STRIP, 0.0f);
        for (Index row = first; row <= last; ++row) {
            const float* from = rows.at(row, height) + plane * STRIP;
            for (Index i = 0; i < PLANES * STRIP; ++i) sums[i] += from[i];
        }
    }
    void move_down(const AveragedRows& rows, Index row, Index height) {  // from around `row` to around the next
        move_window(sums.data(), rows.at(row + first, height) + plane * STRIP, rows.at(row + last + 1, height) + plane * STRIP);
    }
    float rows() const { return float(last - first + 1); }
};

struct Width {
    std::size_t averaged;  // which rows it looks at
    RowWindow inside, above, below;
};

// The rows of a column that are looked at: those within a margin of the pixels of a turned image; the last one is exclusive.
struct Turned {
    double to_x[3], to_y[3];  // from column and row to those of the image before it was turned
    Index height, width;

    std::pair<Index, Index> rows(Index column, Index count) const {
        const double margin = 3.0;  // px: what an interpolation reads beside the image
        double first = 0, last = double(count);
        const auto cut = [&](const double (&to)[3], Index size) {
            const double at = to[0] * double(column) + to[2], low = -margin - at, high = double(size) + margin - at;
            if (std::fabs(to[1]) < 1e-9) {
                if (low > 0 || high < 0) last = 0;
                return;
            }
            first = std::max(first, std::min(low / to[1], high / to[1]));
            last = std::min(last, std::max(low / to[1], high / to[1]) + 1);
        };
        cut(to_x, width);
        cut(to_y, height);
        return {Index(first), std::max(Index(last), Index(first))};
    }
};

class Ribbons {
   public:
    Ribbons(const Volume<float>& image, const Vector<double>& widths, double noise, double length_widths, Index min_length)
        : image(image), height(image.shape(0)), width(image.shape(1)), noise(float(noise)) {
        for (std::size_t w = 0; w < widths.shape(0); ++w) add_width(widths(w), length_widths, min_length);
        for (AveragedRows& rows : averaged) {
            margin = std::max(margin, rows.half + 1);
            rows.kept.resize((2 * rows.reach + 3) * (PLANES + 1) * STRIP);
            rows.sums.assign(height * PLANES, 0.0);
        }
        across = STRIP + 2 * margin;
        source.resize(height * across * PLANES);
    }

    void score(const Turned& turned, std::vector<float>& best, std::vector<Byte>& which) {
        std::vector<std::pair<Index, Index>> strips;
        for (Index left = 0; left < width; left += STRIP) {
            strips.emplace_back(height, 0);
            for (Index x = left; x < std::min(left + STRIP, width); ++x) {
                const auto rows = turned.rows(x, height);
                if (rows.first >= rows.second) continue;
                strips.back().first = std::min(strips.back().first, rows.first);
                strips.back().second = std::max(strips.back().second, std::min(rows.second, height));
            }
        }
        for (std::size_t i = 0; i < strips.size(); ++i) {
            Index later = 0;  // rows that the strips after this one need
            for (std::size_t k = i + 1; k < strips.size(); ++k) later = std::max(later, strips[k].second);
            score_strip(Index(i) * STRIP, strips[i].first, strips[i].second, later, best, which);
        }
    }

   private:
    const Volume<float>& image;
    Index height, width, margin = 0, across = 0;
    float noise;
    std::vector<float> source;  // (H, across, PLANES), a strip with a margin on either side, where the border is repeated
    std::vector<AveragedRows> averaged;
    std::vector<Width> ribbons;

    const float* pixel(Index row, Index x) const { return source.data() + (row * across + x + margin) * PLANES; }  // x from the strip's left

    void add_width(double px, double length_widths, Index min_length) {
        const Index half = std::max<Index>(min_length, Index(std::lround(length_widths * px))) / 2;
        const Index core = std::max<Index>(0, Index(std::lround(0.35 * px - 0.5)));  // rows on either side of the middle one
        const Index side = std::max<Index>(2, Index(std::lround(px / 4))), gap = Index(std::lround(px / 2 + 1));
        if (averaged.empty() || averaged.back().half != half) {
            averaged.emplace_back();
            averaged.back().half = half;
        }
        averaged.back().reach = std::max({averaged.back().reach, gap + side, core});
        ribbons.push_back({averaged.size() - 1, {-core, core, 0, {}}, {-gap - side + 1, -gap, 1, {}}, {gap, gap + side - 1, 1, {}}});
    }

    void load_strip(Index left) {
        for (Index row = 0; row < height; ++row) {
            for (Index x = 0; x < across; ++x) {
                const Index column = std::min(std::max<Index>(left + x - margin, 0), width - 1);
                const float* from = image.data() + (row * width + column) * CHANNELS;
                float* to = source.data() + (row * across + x) * PLANES;
                float square = 0.0f;
                for (Index k = 0; k < CHANNELS; ++k) {
                    to[k] = from[k];
                    square += from[k] * from[k];
                }
                to[CHANNELS] = square;
            }
        }
        if (left > 0) return;
        for (AveragedRows& rows : averaged) {
            for (Index row = 0; row < height; ++row) {
                for (Index x = -rows.half; x <= rows.half; ++x) {
                    for (Index k = 0; k < PLANES; ++k) rows.sums[row * PLANES + k] += pixel(row, x)[k];
                }
            }
        }
    }

    void average_up_to(AveragedRows& rows, Index last) {
        float means[STRIP * PLANES];
        const Index window = 2 * rows.half + 1;
        for (; rows.next <= std::min(last, height - 1); ++rows.next) {
            average_along(pixel(rows.next, -rows.half), window, STRIP, 1.0f / float(window), rows.sums.data() + rows.next * PLANES, means);
            spread_planes(means, rows.kept.data() + rows.next % (2 * rows.reach + 3) * (PLANES + 1) * STRIP);
        }
    }

    // Score the rows from `first` to before `last` of a strip. The sums begin at the top of the image wherever the first row is.
    void score_strip(Index left, Index first, Index last, Index later, std::vector<float>& best, std::vector<Byte>& which) {
        load_strip(left);
        for (AveragedRows& rows : averaged) {
            rows.next = 0;
            average_up_to(rows, rows.reach);
        }
        for (Width& ribbon : ribbons) {
            for (RowWindow* window : {&ribbon.inside, &ribbon.above, &ribbon.below}) window->start(averaged[ribbon.averaged], height);
        }
        const Index count = std::min(STRIP, width - left);
        for (Index row = 0; row < last; ++row) {
            for (AveragedRows& rows : averaged) average_up_to(rows, row + rows.reach + 1);
            float highest[STRIP] = {};
            std::int32_t index[STRIP] = {};
            for (std::size_t w = 0; w < ribbons.size(); ++w) {
                Width& at = ribbons[w];
                const float in = 1.0f / at.inside.rows(), out = 1.0f / at.above.rows();
                if (row >= first) {
                    score_row(at.inside.sums.data(), at.above.sums.data(), at.below.sums.data(), in, out, noise, std::int32_t(w), highest, index);
                }
                for (RowWindow* window : {&at.inside, &at.above, &at.below}) window->move_down(averaged[at.averaged], row, height);
            }
            if (row < first) continue;
            std::copy_n(highest, count, best.begin() + row * width + left);
            std::copy_n(index, count, which.begin() + row * width + left);
        }
        for (AveragedRows& rows : averaged) average_up_to(rows, later + rows.reach);  // the sums of the next strip's first column
    }
};

auto ribbon_scores(Volume<float> image, Vector<double> widths, double noise, double length_widths, Index min_length, Matrix<double> back,
                   std::pair<Index, Index> shape) {
    const Index height = image.shape(0), width = image.shape(1), size = height * width;
    require(image.shape(2) == CHANNELS && size > 0, "the image is not (H, W, 3) with pixels");
    require(noise > 0 && widths.shape(0) > 0 && widths.shape(0) < 256, "noise is not over 0, or there are no widths");
    require(back.shape(0) == 2 && back.shape(1) == 3, "back is not (2, 3)");
    count_visits(size * Index(1 + widths.shape(0)));
    std::vector<float> best(size, 0.0f);
    std::vector<Byte> which(size, 0);
    {
        nb::gil_scoped_release released;
        const Turned turned{{back(0, 0), back(0, 1), back(0, 2)}, {back(1, 0), back(1, 1), back(1, 2)}, shape.first, shape.second};
        Ribbons(image, widths, noise, length_widths, min_length).score(turned, best, which);
    }
    return nb::make_tuple(to_numpy(std::move(best), height, width), to_numpy(std::move(which), height, width));
}

}  // namespace

void bind_ribbons(nb::module_& m) {
    m.def("ribbon_scores", &ribbon_scores, "image"_a.noconvert(), "widths"_a.noconvert(), "noise"_a, "length_widths"_a, "min_length"_a,
          "back"_a.noconvert(), "shape"_a);
}
