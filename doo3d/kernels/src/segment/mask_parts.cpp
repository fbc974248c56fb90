// The parts of a mask and their half-widths.
#include "mask_runs.h"
#include "order_statistics.h"

#include <limits>

namespace {

auto mask_parts(Matrix<bool> mask, Index min_pixels, Vector<std::int64_t> asked_pixels) {
    const Index height = mask.shape(0), width = mask.shape(1);
    count_bytes(height * width);
    count_visits(Index(asked_pixels.shape(0)));
    BitImage asked(height, width);
    for (std::size_t i = 0; i < asked_pixels.shape(0); ++i) {
        require(asked_pixels(i) >= 0 && asked_pixels(i) < height * width, "a pixel asked for is not in the mask");
        asked.set(asked_pixels(i) / width, asked_pixels(i) % width);
    }
    MeasuredParts found;
    {
        nb::gil_scoped_release released;
        found = measure(parts_of(runs_of(bytes_of(mask), height, width)), height, width, min_pixels, asked);
    }
    return found.to_python();
}

}  // namespace

// Widen the distances of the pixels over a row's runs, from the row before (from the one after, and from the right, if not forward).
void MaskHalfWidths::pass(const Run* first, const Run* last, bool forward) {
    const float unknown = std::numeric_limits<float>::max(), straight = float(STRAIGHT), diagonal = float(DIAGONAL);
    const Index step = forward ? 1 : -1, count = last - first;
    const Index border = forward ? 0 : height - 1, start = (forward ? first : last - 1)->row;
    for (Index y = -1; y < 2; ++y) beyond(y, unknown);
    if (start == border) std::fill(row(start - step) - 1, row(start - step) + width + 1, unknown);
    Index pixel = forward ? 0 : Index(distance.size()) - 1, clear = 0;
    for (Index k = 0; k < count; ++k) {
        const Run& run = forward ? first[k] : last[-1 - k];
        if (k > 0 && run.row != (forward ? first[k - 1] : last[-k]).row) {  // forget the row before the last one
            if (start == border && run.row == start + step) std::fill(row(start - step), row(start - step) + width, 0.0f);
            for (; (forward ? first[clear] : last[-1 - clear]).row != run.row - step; ++clear) {
                const Run& old = forward ? first[clear] : last[-1 - clear];
                std::fill(row(old.row) + old.start, row(old.row) + old.end, 0.0f);
            }
        }
        const float* before = row(run.row - step);
        float* own = row(run.row);
        for (Index x = forward ? run.start : run.end - 1; x >= run.start && x < run.end; x += step, pixel += step) {
            const float least = std::min({before[x - step] + diagonal, before[x] + straight, before[x + step] + diagonal,
                                          own[x - step] + straight});
            own[x] = distance[pixel] = std::min(distance[pixel], least);
        }
    }
    std::fill(values.begin(), values.end(), 0.0f);
}

// Collect the half-widths at the pixels that are as far from the edge as all around them.
void MaskHalfWidths::find_middle(const Run* first, const Run* last) {
    const float* from = distance.data();
    const Run *shown = first, *clear = first;
    const auto show = [&](Index y) {
        for (; shown != last && shown->row <= y; ++shown) {
            std::copy(from, from + (shown->end - shown->start), row(shown->row) + shown->start);
            from += shown->end - shown->start;
        }
    };
    for (const Run* run = first; run != last; ++run) {
        for (; clear->row < run->row - 1; ++clear) std::fill(row(clear->row) + clear->start, row(clear->row) + clear->end, 0.0f);
        show(run->row + 1);
        const float *up = row(run->row - 1), *own = row(run->row), *down = row(run->row + 1);
        for (Index x = run->start; x < run->end; ++x) {
            const float beside = std::max({up[x - 1], up[x], up[x + 1], own[x - 1], own[x + 1], down[x - 1], down[x], down[x + 1]});
            if (own[x] >= beside - 1e-3f) middle.push_back(own[x] - 0.5f);
        }
    }
    std::fill(values.begin(), values.end(), 0.0f);
}

std::pair<double, double> MaskHalfWidths::operator()(const Part& part) {
    const Run *first = part.runs.data(), *last = first + part.runs.size();
    distance.assign(part.size, std::numeric_limits<float>::max());
    middle.clear();
    pass(first, last, true);
    pass(first, last, false);
    find_middle(first, last);
    if (middle.empty()) return {0.0, 0.0};
    return {quantile(middle, 0.5), quantile(middle, 0.85)};
}

MeasuredParts measure(const std::vector<Part>& parts, Index height, Index width, Index min_pixels, const BitImage& asked) {
    MeasuredParts found;
    MaskHalfWidths half_widths(height, width);
    for (const Part& part : parts) {
        bool holds = false;
        for (const Run& run : part.runs) {
            for (Index x = run.start; x < run.end; ++x) {
                found.pixels.push_back(run.row * width + x);
                holds |= asked.has(run.row, x);
            }
        }
        found.starts.push_back(std::int64_t(found.pixels.size()));
        found.holds.push_back(holds);
        const auto half = holds || part.size < min_pixels ? std::make_pair(0.0, 0.0) : half_widths(part);
        found.half.insert(found.half.end(), {half.first, half.second});
    }
    return found;
}

void bind_mask_parts(Module& m) {
    // Return the 8-connected parts of a mask, with their half-widths.
    //
    // Parameters
    // ----------
    // mask
    //     (H, W) bool.
    // min_pixels
    //     pixels of a part below which its widths are not measured.
    // asked
    //     (Q,) row-major indices of pixels; parts with one of them are not measured either.
    //
    // Returns
    // -------
    // pixels : (N,) row-major indices of the mask's pixels, part by part, ascending in each.
    // starts : (K + 1,) where each of the K parts begins in `pixels`, and N.
    // half_widths : (K, 2) px, distance from the middle to the edge, in the median and at the 85th percentile; 0 if not measured.
    // holds : (K,) bool, the parts with pixels of `asked`.
    m.def("mask_parts", &mask_parts, "mask"_a.noconvert(), "min_pixels"_a, "asked"_a.noconvert());
}
