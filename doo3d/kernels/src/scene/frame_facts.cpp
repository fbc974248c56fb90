// Runs of a mask, without small components and with small holes filled.
#include "frame_facts.h"

namespace {

// Return the number of pixels of the set that each run is of, at the run that stands for the set.
std::vector<Index> sizes(const std::vector<Run>& runs, RunSets& sets) {
    std::vector<Index> size(runs.size());
    for (std::size_t i = 0; i < runs.size(); ++i) size[sets.root(std::int32_t(i))] += runs[i].size();
    return size;
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
    for (const Run& run : component) size += run.size();
    for (std::size_t i = 0; i < gaps.size(); ++i) size += sets.root(std::int32_t(i)) ? gaps[i].size() : 0;
    return size;
}

}  // namespace

Box box_of(const std::vector<Run>& runs) {
    if (runs.empty()) return Box();
    Box box{runs.front().row, runs.back().row + 1, runs.front().start, runs.front().end};
    for (const Run& run : runs) {
        box.left = std::min<Index>(box.left, run.start);
        box.right = std::max<Index>(box.right, run.end);
    }
    return box;
}

FrameFacts::FrameFacts(const Byte* mask, Index height, Index width, Index min_pixels) : height(height), width(width) {
    require(height < Index(1) << 30 && width < Index(1) << 30, "the mask is too large");
    runs = runs_of(mask, height, width);
    for (const Run& run : runs) selected += run.size();
    if (min_pixels > 1) {
        remove_components(min_pixels);
        fill_holes(min_pixels);
    }
    box = box_of(runs);
    count_visits(4 * Index(runs.size()) + selected);
    for (const Run& run : runs) count += run.size();
}

// Remove the 8-connected components that are small with their holes filled.
void FrameFacts::remove_components(Index min_pixels) {
    RunSets sets = connected(runs, 1);
    const std::vector<Index> size = sizes(runs, sets);
    bool any_small = false;
    for (std::size_t i = 0; i < runs.size(); ++i) any_small |= size[sets.root(std::int32_t(i))] < min_pixels;
    if (!any_small) return;
    std::vector<std::vector<Run>> small(runs.size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const std::int32_t root = sets.root(std::int32_t(i));
        if (size[root] < min_pixels) small[root].push_back(runs[i]);
    }
    std::vector<Byte> gone(runs.size());
    for (std::size_t i = 0; i < runs.size(); ++i) gone[i] = !small[i].empty() && filled_size(small[i]) < min_pixels;
    std::size_t left = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
        if (gone[sets.root(std::int32_t(i))]) {
            removed += runs[i].size();
        } else {
            runs[left++] = runs[i];
        }
    }
    runs.resize(left);
}

// Fill the 4-connected holes that are small.
void FrameFacts::fill_holes(Index min_pixels) {
    if (runs.empty()) return;
    const std::vector<Run> gaps = background_of(runs);
    RunSets sets = connected(gaps, 0);
    const std::vector<Index> size = sizes(gaps, sets);
    std::vector<Run> holes;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
        const std::int32_t root = sets.root(std::int32_t(i));
        if (root && size[root] < min_pixels) holes.push_back(gaps[i]);
    }
    if (holes.empty()) return;
    std::vector<Run> merged(runs.size() + holes.size());
    std::merge(runs.begin(), runs.end(), holes.begin(), holes.end(), merged.begin(), [](const Run& a,
               const Run& b) { return a.row != b.row ? a.row < b.row : a.start < b.start; });
    runs.clear();
    for (const Run& run : merged) {
        if (!runs.empty() && runs.back().row == run.row && runs.back().end == run.start) {
            runs.back().end = run.end;
        } else {
            runs.push_back(run);
        }
    }
    for (const Run& run : holes) filled += run.size();
}
