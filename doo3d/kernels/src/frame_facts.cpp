// Runs of a mask: connected components, holes, distance, medial axis and skeleton.
#include "frame_facts.h"

#include "zhang_suen.h"

#include <algorithm>

namespace {

// px by which a neighbor of a pixel of the medial axis may be farther from the outside.
constexpr float SLACK = 1e-3f;

// Return the number of pixels of the set that each run is of, at the run that stands for the set.
std::vector<Index> sizes(const std::vector<Run>& runs, RunSets& sets) {
    std::vector<Index> size(runs.size());
    for (std::size_t i = 0; i < runs.size(); ++i) size[sets.root(std::int32_t(i))] += runs[i].end - runs[i].start;
    return size;
}

Box box_of(const std::vector<Run>& runs) {
    if (runs.empty()) return Box();
    Box box{runs.front().row, runs.back().row + 1, runs.front().start, runs.front().end};
    for (const Run& run : runs) {
        box.left = std::min<Index>(box.left, run.start);
        box.right = std::max<Index>(box.right, run.end);
    }
    return box;
}

// Return the runs of the background within the box of some runs and one pixel around it; the first lies outside of all.
std::vector<Run> background_of(const std::vector<Run>& runs) {
    const Box box = box_of(runs);
    const auto left = std::int32_t(box.left - 1), right = std::int32_t(box.right + 1);
    std::vector<Run> gaps{{std::int32_t(box.top - 1), left, right}};
    gaps.reserve(2 * runs.size() + 2);
    std::size_t next = 0;
    for (auto row = std::int32_t(box.top); row < box.bottom; ++row) {
        std::int32_t column = left;
        for (; next < runs.size() && runs[next].row == row; ++next) {
            gaps.push_back({row, column, runs[next].start});
            column = runs[next].end;
        }
        gaps.push_back({row, column, right});
    }
    gaps.push_back({std::int32_t(box.bottom), left, right});
    return gaps;
}

// Return the number of pixels of a component with its holes filled: its box without the background that is reached from outside.
Index filled_size(const std::vector<Run>& component) {
    const std::vector<Run> gaps = background_of(component);
    RunSets sets = connected(gaps, 0);
    Index size = 0;
    for (const Run& run : component) size += run.end - run.start;
    for (std::size_t i = 0; i < gaps.size(); ++i) size += sets.root(std::int32_t(i)) ? gaps[i].end - gaps[i].start : 0;
    return size;
}

// Set the distances of the pixels of a run to the least by way of the two rows before, `step` away each, and of what they are so far,
// if `known`. The pixel beside comes after, so that this loop can be vectorized.
void step_from_rows(float* pixels, Index count, Index step, bool known) {
    const float *one = pixels - step, *two = one - step;
    for (Index i = 0; i < count; ++i) {
        const float near = least(least(one[i - 1], one[i + 1]) + CORNER, one[i] + SIDE);
        const float far = least(least(two[i - 1], two[i + 1]), least(one[i - 2], one[i + 2])) + KNIGHT;
        const float found = least(near, far);
        pixels[i] = known ? least(pixels[i], found) : found;
    }
}

}  // namespace

FrameFacts::FrameFacts(const Byte* mask, Index height, Index width, Index min_pixels) : height_(height), width_(width) {
    runs_ = runs_of(mask, height, width);
    for (const Run& run : runs_) selected_ += run.end - run.start;
    if (min_pixels > 1) {
        remove_components(min_pixels);
        fill_holes(min_pixels);
    }
    box_ = box_of(runs_);
    count_visits(4 * Index(runs_.size()) + selected_);
    for (const Run& run : runs_) count_ += run.end - run.start;
}

// Remove the 8-connected components that are small with their holes filled.
void FrameFacts::remove_components(Index min_pixels) {
    RunSets sets = connected(runs_, 1);
    const std::vector<Index> size = sizes(runs_, sets);
    bool any_small = false;
    for (std::size_t i = 0; i < runs_.size(); ++i) any_small |= size[sets.root(std::int32_t(i))] < min_pixels;
    if (!any_small) return;
    std::vector<std::vector<Run>> small(runs_.size());
    for (std::size_t i = 0; i < runs_.size(); ++i) {
        const std::int32_t root = sets.root(std::int32_t(i));
        if (size[root] < min_pixels) small[root].push_back(runs_[i]);
    }
    std::vector<Byte> gone(runs_.size());
    for (std::size_t i = 0; i < runs_.size(); ++i) gone[i] = !small[i].empty() && filled_size(small[i]) < min_pixels;
    std::size_t left = 0;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
        if (gone[sets.root(std::int32_t(i))]) {
            removed_ += runs_[i].end - runs_[i].start;
        } else {
            runs_[left++] = runs_[i];
        }
    }
    runs_.resize(left);
}

// Fill the 4-connected holes that are small.
void FrameFacts::fill_holes(Index min_pixels) {
    if (runs_.empty()) return;
    const std::vector<Run> gaps = background_of(runs_);
    RunSets sets = connected(gaps, 0);
    const std::vector<Index> size = sizes(gaps, sets);
    std::vector<Run> holes;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
        const std::int32_t root = sets.root(std::int32_t(i));
        if (root && size[root] < min_pixels) holes.push_back(gaps[i]);
    }
    if (holes.empty()) return;
    std::vector<Run> merged(runs_.size() + holes.size());
    std::merge(runs_.begin(), runs_.end(), holes.begin(), holes.end(), merged.begin(),
               [](const Run& a, const Run& b) { return a.row != b.row ? a.row < b.row : a.start < b.start; });
    runs_.clear();
    for (const Run& run : merged) {
        if (!runs_.empty() && runs_.back().row == run.row && runs_.back().end == run.start) {
            runs_.back().end = run.end;
        } else {
            runs_.push_back(run);
        }
    }
    for (const Run& run : holes) filled_ += run.end - run.start;
}

// Two passes, down and up, each along the runs only: what is outside keeps the distance 0.
const std::vector<float>& FrameFacts::distance() {
    if (!distance_.empty() || runs_.empty()) return distance_;
    const Index pitch = columns() + 2 * PADDING;
    count_bytes(4 * (rows() + 2 * PADDING) * pitch);
    count_visits(2 * count_);
    distance_.assign((rows() + 2 * PADDING) * pitch, 0.0f);
    const auto at = [&](const Run& run, Index column) {
        return distance_.data() + (run.row - box_.top + PADDING) * pitch + column - box_.left + PADDING;
    };
    for (const Run& run : runs_) {
        const Index count = run.end - run.start;
        float* pixels = at(run, run.start);
        step_from_rows(pixels, count, pitch, false);
        for (Index i = 0; i < count; ++i) pixels[i] = least(pixels[i], pixels[i - 1] + SIDE);
    }
    for (auto run = runs_.rbegin(); run != runs_.rend(); ++run) {
        const Index count = run->end - run->start;
        float* pixels = at(*run, run->start);
        step_from_rows(pixels, count, -pitch, true);
        for (Index i = count; i--;) pixels[i] = least(pixels[i], pixels[i + 1] + SIDE);
    }
    return distance_;
}

const MedialAxis& FrameFacts::axis() {
    if (has_axis_ || runs_.empty()) return axis_;
    has_axis_ = true;
    distance();
    count_visits(count_);
    const Index pitch = columns() + 2 * PADDING;
    for (std::size_t stop = runs_.size(), start = stop; stop; stop = start) {  // row by row from below, each from the left
        while (start && runs_[start - 1].row == runs_[stop - 1].row) --start;
        for (std::size_t k = start; k < stop; ++k) {
            const Run& run = runs_[k];
            const float* pixel = distance_.data() + (run.row - box_.top + PADDING) * pitch + run.start - box_.left + PADDING;
            for (Index column = run.start; column < run.end; ++column, ++pixel) {
                float farthest = most(pixel[-1], pixel[1]);
                for (Index side = -1; side < 2; ++side) farthest = most(farthest, most(pixel[side - pitch], pixel[side + pitch]));
                if (*pixel < farthest - SLACK) continue;
                axis_.rows.push_back(run.row);
                axis_.columns.push_back(column);
                axis_.distances.push_back(*pixel);
            }
        }
    }
    return axis_;
}

std::vector<Index> FrameFacts::skeleton() {
    const std::vector<float>& inside = distance();
    const Index width = columns() + 2, pitch = columns() + 2 * PADDING;
    std::vector<Byte> codes((rows() + 2) * width);
    count_bytes(2 * Index(codes.size()));
    count_visits(count_);
    std::vector<std::int32_t> pixels;
    std::vector<Index> kept;
    pixels.reserve(count_);
    for_each_pixel([&](Index row, Index column) {
        const Index v = row - box_.top, u = column - box_.left, pixel = (v + 1) * width + u + 1;
        const float* at = inside.data() + (v + PADDING) * pitch + u + PADDING;
        codes[pixel] = 255;
        pixels.push_back(std::int32_t(pixel));
        if (*at >= 2) return;  // farther in, all neighbors are of the object
        for (int k = 0; k < 8; ++k) {
            if (!(at[RING_ROWS[k] * pitch + RING_COLUMNS[k]] > 0)) codes[pixel] &= Byte(~(1 << k));
        }
        if (!codes[pixel]) kept.push_back(pixel);
    });
    const std::size_t alone = kept.size();  // pixels without neighbors: their code is 0, and they stay
    thin_codes(codes, width, std::move(pixels));
    const Index end = Index(codes.size());
    for (Index pixel = first_set(codes.data(), 0, end); pixel < end; pixel = first_set(codes.data(), pixel + 1, end)) {
        kept.push_back(pixel);
    }
    std::inplace_merge(kept.begin(), kept.begin() + Index(alone), kept.end());
    return kept;
}

// Set the pixels of the box within `reach` columns of each run to the largest distance that near in their row.
void FrameFacts::spread_rows(Index reach, std::vector<float>& spread) const {
    const Index width = columns(), pitch = width + 2 * PADDING;
    std::vector<float> row(width + 2 * reach);  // the distances of the row, with `reach` columns of outside on either side
    for (std::size_t start = 0, stop = 0; start < runs_.size(); start = stop) {
        const Index v = runs_[start].row - box_.top;
        const float* inside = distance_.data() + (v + PADDING) * pitch + PADDING;
        std::copy(inside, inside + width, row.begin() + reach);
        for (Index done = 0; stop < runs_.size() && runs_[stop].row == runs_[start].row; ++stop) {
            const Index first = std::max(done, runs_[stop].start - box_.left - reach);
            const Index count = std::min(width, runs_[stop].end - box_.left + reach) - first;
            float* to = spread.data() + v * width + first;
            for (Index shift = 0; shift <= 2 * reach; ++shift) {
                const float* from = row.data() + first + shift;
                for (Index i = 0; i < count; ++i) to[i] = most(to[i], from[i]);
            }
            done = std::max(done, first + count);
        }
    }
}

// The largest along the rows first, for all pixels near a run; then along the columns, for the pixels of the runs alone.
std::vector<Byte> FrameFacts::in_core(const Index* pixels, Index count, Index reach, float fraction, float margin) {
    distance();
    const Index width = columns(), pitch = width + 2 * PADDING;
    reach = std::min(reach, std::max(rows(), width));
    std::vector<float> spread(rows() * width), peak(rows() * width);
    count_bytes(8 * rows() * width);
    count_visits(count + (4 * reach + 2) * (count_ + reach * Index(runs_.size())));
    spread_rows(reach, spread);
    for (const Run& run : runs_) {
        const Index v = run.row - box_.top, length = run.end - run.start;
        float* to = peak.data() + v * width + run.start - box_.left;
        for (Index row = std::max<Index>(0, v - reach); row <= std::min(rows() - 1, v + reach); ++row) {
            const float* from = spread.data() + row * width + run.start - box_.left;
            for (Index i = 0; i < length; ++i) to[i] = most(to[i], from[i]);
        }
    }
    std::vector<Byte> core(count);
    for (Index k = 0; k < count; ++k) {
        const Index u = pixels[2 * k] - box_.left, v = pixels[2 * k + 1] - box_.top;
        if (u < 0 || v < 0 || u >= width || v >= rows()) continue;
        const float own = distance_[(v + PADDING) * pitch + u + PADDING], largest = peak[v * width + u];
        core[k] = own > 0 && own >= std::min(fraction * largest, largest - margin);
    }
    return core;
}
