// The pixels near the pixels of a mask, and the largest values near pixels.
#include "frame_facts.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace {

// Return the pieces of the runs [first, last) of a row that no run of another row, [other, stop), covers.
void add_uncovered(const Run* first, const Run* last, const Run* other, const Run* stop, std::vector<Run>& pieces) {
    for (const Run* run = first; run < last; ++run) {
        std::int32_t start = run->start;
        while (other < stop && other->end <= start) ++other;
        for (const Run* over = other; over < stop && over->start < run->end; ++over) {
            if (over->start > start) pieces.push_back({run->row, start, over->start});
            start = std::max(start, over->end);
        }
        if (start < run->end) pieces.push_back({run->row, start, run->end});
    }
}

// Return the pieces of runs, row by row, that have no pixel of the runs beside them in the row that is `step` further.
std::vector<Run> edge_towards(const std::vector<Run>& runs, std::int32_t step) {
    std::vector<std::pair<const Run*, const Run*>> rows;
    for (const Run *run = runs.data(), *end = run + runs.size(); run < end;) {
        const Run* start = run;
        while (run < end && run->row == start->row) ++run;
        rows.emplace_back(start, run);
    }
    std::vector<Run> pieces;
    for (Index i = 0; i < Index(rows.size()); ++i) {
        const auto [first, last] = rows[i];
        const Index k = i + step;
        const bool beside = k >= 0 && k < Index(rows.size()) && rows[k].first->row == first->row + step;
        add_uncovered(first, last, beside ? rows[k].first : last, beside ? rows[k].second : last, pieces);
    }
    count_visits(2 * Index(runs.size()));
    return pieces;
}

// Every run is widened in its own row, and its edges in the rows above and below, in each as far as the disc reaches there. A pixel
// with another above it adds nothing further up: that one reaches as far aside there, or farther.
auto near_mask(Matrix<bool> mask, double reach, bool inclusive) {
    const Index height = mask.shape(0), width = mask.shape(1);
    require(reach >= 0, "reach is negative");
    const Byte* bytes = bytes_of(mask);
    auto* image = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(image, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    {
        nb::gil_scoped_release released;
        const FrameFacts facts(bytes, height, width, 0);
        const std::vector<Run> edges[] = {edge_towards(facts.runs(), -1), edge_towards(facts.runs(), 1)};
        count_bytes(height * width);
        const auto is_near = [&](Index dx, Index dy) {
            const double length = chamfer_length(dx, dy);
            return inclusive ? length <= reach : length < reach;
        };
        const Index most_rows = std::min<Index>(height - 1, Index(std::min(reach, 1e9)) + 1);
        for (Index dy = 0; dy <= most_rows && is_near(0, dy); ++dy) {
            Index dx = 0;
            while (dx < width && is_near(dx + 1, dy)) ++dx;
            for (const std::int32_t way : {-1, 1}) {
                const std::vector<Run>& runs = dy ? edges[way > 0] : facts.runs();
                count_visits(Index(runs.size()));
                for (const Run& run : runs) {
                    const Index row = run.row + way * dy;
                    const Index start = std::max<Index>(0, run.start - dx), end = std::min(width, run.end + dx);
                    if (row >= 0 && row < height) std::fill(image + row * width + start, image + row * width + end, true);
                }
            }
        }
    }
    return MatrixResult<bool>(image, {std::size_t(height), std::size_t(width)}, owner);
}

// The largest of the 1, 2, 4, ... values from each place of a row on, for the last rows of an image. A row of the window is covered
// by two such stretches, which may overlap.
class Largest {
public:
    Largest(const Matrix<float>& values, const Vector<Index>& half, Index margin)
        : values_(values), margin_(margin), length_(Index(values.shape(1)) + 2 * margin), slots_(2 * Index(half.shape(0)) - 1) {
        for (Index side = 1; side <= 2 * margin + 1; side *= 2) ++levels_;
        tables_.resize(slots_ * levels_ * length_);
    }

    void add(Index row) {
        const Index width = values_.shape(1);
        float* table = level(row, 0);
        std::fill(table, table + length_, std::numeric_limits<float>::lowest());
        std::copy_n(values_.data() + row * width, width, table + margin_);
        for (Index k = 1, side = 1; k < levels_; ++k, side *= 2) {
            const float* finer = level(row, k - 1);
            float* coarser = level(row, k);
            for (Index i = 0; i + side < length_; ++i) coarser[i] = larger(finer[i], finer[i + side]);
            for (Index i = length_ - side; i < length_; ++i) coarser[i] = finer[i];
        }
        count_visits(levels_ * length_);
    }

    // Raise `result` to the largest values within `half` columns of the pixels [start, end) of a row.
    void raise(float* result, Index row, Index half, Index start, Index end) const {
        Index k = 0, side = 1;
        while (2 * side <= 2 * half + 1) ++k, side *= 2;
        const float* left = level(row, k) + start + margin_ - half;
        const float* right = left + 2 * half + 1 - side;
        for (Index i = 0; i < end - start; ++i) result[i] = larger(result[i], larger(left[i], right[i]));
        count_visits(end - start);
    }

private:
    const Matrix<float>& values_;
    Index margin_, length_, slots_, levels_ = 0;
    std::vector<float> tables_;

    static float larger(float a, float b) { return a < b ? b : a; }
    float* level(Index row, Index k) { return tables_.data() + (row % slots_ * levels_ + k) * length_; }
    const float* level(Index row, Index k) const { return tables_.data() + (row % slots_ * levels_ + k) * length_; }
};

auto largest_within(Matrix<float> values, Matrix<bool> wanted, Vector<Index> half) {
    const Index height = values.shape(0), width = values.shape(1), rows = half.shape(0);
    require(Index(wanted.shape(0)) == height && Index(wanted.shape(1)) == width, "values and wanted differ in shape");
    require(rows > 0, "the window has no row");
    Index margin = 0;
    for (Index i = 0; i < rows; ++i) {
        require(half(i) >= 0, "half a width is negative");
        margin = std::max(margin, half(i));
    }
    std::vector<float> result(height * width, 0.0f);
    {
        nb::gil_scoped_release released;
        Largest largest(values, half, margin);
        Index added = 0;
        for (const Run& run : runs_of(bytes_of(wanted), height, width)) {
            float* at = result.data() + run.row * width + run.start;
            std::fill(at, at + (run.end - run.start), std::numeric_limits<float>::lowest());
            const Index first = std::max<Index>(0, run.row - rows + 1), last = std::min<Index>(height, run.row + rows);
            for (added = std::max(added, first); added < last; ++added) largest.add(added);
            for (Index row = first; row < last; ++row) largest.raise(at, row, half(std::abs(row - run.row)), run.start, run.end);
        }
    }
    return to_numpy(std::move(result), height, width);
}

}  // namespace

void bind_dilation(Module& m) {
    // Return the pixels of an image that are nearer than `reach` px to a pixel of a mask, or as near.
    //
    // The distance is a chamfer distance by steps on a 5 x 5 neighborhood, as that of `medial_axis`.
    //
    // Parameters
    // ----------
    // mask
    //     (H, W) bool
    // reach
    //     px
    // inclusive
    //     whether a pixel at the distance `reach` is near
    //
    // Returns
    // -------
    // (H, W) bool; the pixels of the mask are near themselves
    m.def("near_mask", &near_mask, "mask"_a.noconvert(), "reach"_a, "inclusive"_a);
    // Return the largest value in a window around each pixel that is wanted, as a dilation does.
    //
    // Parameters
    // ----------
    // values
    //     (H, W) float32
    // wanted
    //     (H, W) bool, the pixels whose windows are searched
    // half
    //     (R + 1,) int64, half the widths of the window's rows: of the middle row, and of those 1 to R above and below it
    //
    // Returns
    // -------
    // (H, W) float32; 0 where it is not wanted
    m.def("largest_within", &largest_within, "values"_a.noconvert(), "wanted"_a.noconvert(), "half"_a.noconvert());
}
