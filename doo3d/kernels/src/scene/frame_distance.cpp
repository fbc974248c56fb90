// What follows from the distances of a mask's pixels from the outside: medial axis, skeleton, cores of strands.
#include "frame_facts.h"
#include "zhang_suen.h"

namespace {

// px by which a neighbor of a pixel of the medial axis may be farther from the outside.
constexpr float SLACK = 1e-3f;

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

FrameFacts::~FrameFacts() {
    if (!distance_) return;
    for (const Run& run : runs) std::fill_n(distance_at(run.row, run.start), run.size(), 0.0f);
}

float* FrameFacts::distance_at(Index row, Index column) {
    return distance_->data() + (row - box.top + PADDING) * (columns() + 2 * PADDING) + column - box.left + PADDING;
}

// Two passes, down and up, each along the runs only: what is outside keeps the distance 0.
const float* FrameFacts::distance() {
    if (distance_) return distance_->data();
    const Index pitch = columns() + 2 * PADDING;
    count_visits(2 * count);
    distance_ = std::make_unique<Zeros<float>>((rows() + 2 * PADDING) * pitch);
    for (const Run& run : runs) {
        const Index count = run.size();
        float* pixels = distance_at(run.row, run.start);
        step_from_rows(pixels, count, pitch, false);
        for (Index i = 0; i < count; ++i) pixels[i] = least(pixels[i], pixels[i - 1] + SIDE);
    }
    for (auto run = runs.rbegin(); run != runs.rend(); ++run) {
        const Index count = run->size();
        float* pixels = distance_at(run->row, run->start);
        step_from_rows(pixels, count, -pitch, true);
        for (Index i = count; i--;) pixels[i] = least(pixels[i], pixels[i + 1] + SIDE);
    }
    return distance_->data();
}

const MedialAxis& FrameFacts::axis() {
    if (has_axis_ || runs.empty()) return axis_;
    has_axis_ = true;
    distance();
    count_visits(count);
    const Index pitch = columns() + 2 * PADDING;
    for (std::size_t stop = runs.size(), start = stop; stop; stop = start) {  // row by row from below, each from the left
        while (start && runs[start - 1].row == runs[stop - 1].row) --start;
        for (std::size_t k = start; k < stop; ++k) {
            const Run& run = runs[k];
            const float* pixel = distance_at(run.row, run.start);
            for (Index column = run.start; column < run.end; ++column, ++pixel) {
                const float *up = pixel - pitch, *down = pixel + pitch;
                const float farthest = std::max({pixel[-1], pixel[1], up[-1], up[0], up[1], down[-1], down[0], down[1]});
                if (*pixel < farthest - SLACK) continue;
                axis_.rows.push_back(run.row);
                axis_.columns.push_back(column);
                axis_.distances.push_back(*pixel);
            }
        }
    }
    return axis_;
}

const std::vector<Index>& FrameFacts::skeleton() {
    if (!skeleton_.empty() || runs.empty()) return skeleton_;
    distance();
    const Index width = columns() + 2, pitch = columns() + 2 * PADDING;
    Zeros<Byte> image((rows() + 2) * width);
    Byte* codes = image.data();
    count_visits(3 * count);
    std::vector<std::int32_t> pixels;
    std::vector<Index> kept;
    pixels.reserve(count);
    const auto code_of = [&](Index row, Index column) -> Byte& { return codes[(row - box.top + 1) * width + column - box.left + 1]; };
    for_each_pixel([&](Index row, Index column) {
        const float* at = distance_at(row, column);
        Byte& code = code_of(row, column);
        code = 255;
        pixels.push_back(std::int32_t(&code - codes));
        if (*at >= 2) return;  // farther in, all neighbors are of the object
        for (int k = 0; k < 8; ++k) {
            if (!(at[RING_ROWS[k] * pitch + RING_COLUMNS[k]] > 0)) code &= Byte(~(1 << k));
        }
        if (!code) kept.push_back(&code - codes);
    });
    const std::size_t alone = kept.size();  // pixels without neighbors: their code is 0, and they stay
    thin_codes(codes, width, std::move(pixels));
    for_each_pixel([&](Index row, Index column) {
        Byte& code = code_of(row, column);
        if (code) kept.push_back(&code - codes);
        code = 0;
    });
    std::inplace_merge(kept.begin(), kept.begin() + Index(alone), kept.end());
    skeleton_ = std::move(kept);
    return skeleton_;
}

template <class Visit>
void FrameFacts::for_each_widened(Index reach, Visit visit) const {
    Index done = 0, row = -1;
    for (const Run& run : runs) {
        if (run.row != row) done = 0;
        row = run.row;
        const Index first = std::max(done, run.start - box.left - reach), last = std::min(columns(), run.end - box.left + reach);
        visit(row, first, last - first);
        done = last;
    }
}

// The largest along the rows first, for all pixels near a run; then along the columns, for the pixels of the runs alone.
std::vector<Byte> FrameFacts::in_core(const Index* pixels, Index count, Index reach, float fraction, float margin) {
    distance();
    const Index width = columns();
    reach = std::min(reach, std::max(rows(), width));
    Zeros<float> spread(rows() * width), peak(rows() * width);
    const auto at = [&](Zeros<float>& image, Index row, Index column) { return image.data() + (row - box.top) * width + column; };
    Visits visits{count};
    std::vector<float> near;
    for_each_widened(reach, [&](Index row, Index first, Index length) {
        near.assign(length + 2 * reach, 0.0f);  // the distances of the row, with `reach` columns on either side
        const Index left = std::max<Index>(first - reach, 0), right = std::min(first + length + reach, width);
        std::copy_n(distance_at(row, box.left + left), right - left, near.begin() + left - (first - reach));
        float* to = at(spread, row, first);
        for (Index shift = 0; shift <= 2 * reach; ++shift) {
            for (Index i = 0; i < length; ++i) to[i] = most(to[i], near[i + shift]);
        }
        visits.count += (2 * reach + 1) * length;
    });
    for (const Run& run : runs) {
        const Index length = run.size();
        float* to = at(peak, run.row, run.start - box.left);
        for (Index row = std::max(box.top, run.row - reach); row <= std::min(box.bottom - 1, run.row + reach); ++row) {
            const float* from = at(spread, row, run.start - box.left);
            for (Index i = 0; i < length; ++i) to[i] = most(to[i], from[i]);
        }
        visits.count += (2 * reach + 1) * length;
    }
    std::vector<Byte> core(count);
    for (Index k = 0; k < count; ++k) {
        const Index u = pixels[2 * k], v = pixels[2 * k + 1];
        if (u < box.left || v < box.top || u >= box.right || v >= box.bottom) continue;
        const float own = *distance_at(v, u), largest = *at(peak, v, u - box.left);
        core[k] = own > 0 && own >= std::min(fraction * largest, largest - margin);
    }
    for_each_widened(reach, [&](Index row, Index first, Index length) { std::fill_n(at(spread, row, first), length, 0.0f); });
    for (const Run& run : runs) std::fill_n(at(peak, run.row, run.start - box.left), run.size(), 0.0f);
    return core;
}

// The disc around each pixel of the skeleton is marked in an image of the box with as much around it, and cleared again.
std::vector<Byte> FrameFacts::near_skeleton(const Index* pixels, Index count, double reach) {
    reach = std::min(reach, double(height + width));
    const Index margin = Index(reach), width = columns() + 2 * margin, pitch = columns() + 2;
    std::vector<Byte> near(count);
    Zeros<Byte> image((rows() + 2 * margin) * width);
    Visits visits{count};
    const auto mark = [&](Byte value) {
        for (Index dy = -margin; dy <= margin; ++dy) {
            Index dx = -1;
            while (chamfer_length(dx + 1, std::abs(dy)) < reach) ++dx;
            if (dx < 0) continue;
            for (const Index pixel : skeleton()) {
                const Index row = pixel / pitch - 1 + margin + dy, column = pixel % pitch - 1 + margin;
                std::fill_n(image.data() + row * width + column - dx, 2 * dx + 1, value);
            }
            visits.count += Index(skeleton_.size());
        }
    };
    mark(1);
    for (Index k = 0; k < count; ++k) {
        const Index column = pixels[2 * k] - box.left + margin, row = pixels[2 * k + 1] - box.top + margin;
        near[k] = column >= 0 && row >= 0 && column < width && row < rows() + 2 * margin && image.data()[row * width + column];
    }
    mark(0);
    return near;
}
