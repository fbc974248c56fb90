#include "depth_facts.h"
#include "order_statistics.h"

namespace {

// Return the mean of the smaller three quarters of values that are not below 0; 0 of nothing.
constexpr double KEPT = 0.75, KEPT_MEAN = 0.5149;  // share, and their mean for normally distributed errors in standard deviations
double mean_of_smaller(const std::vector<double>& values) {
    const auto kept = std::size_t(KEPT * double(values.size()));
    if (!kept) return 0.0;
    std::vector<double> ordered = values;
    const double limit = value_at(ordered, kept);
    double sum = 0.0;
    std::size_t below = 0;
    for (const double value : values) {  // in their own order, so that the sum is the same with every library
        if (value >= limit) continue;
        sum += value;
        ++below;
    }
    return (sum + double(kept - below) * limit) / double(kept);
}

// Return the least float that is not less than a limit: a float is below the one exactly if it is below the other.
float least_float(double limit) {
    const auto near = float(limit);
    return double(near) < limit ? std::nextafter(near, std::numeric_limits<float>::infinity()) : near;
}

// What the neighbors of BLOCK consecutive pixels of a row say: the sum of the readings that agree and of the pixel's own, the number of
// those that agree, and the number of neighbors with a reading.
constexpr Index BLOCK = 16;
struct Votes {
    double total[BLOCK];
    std::int32_t agreeing[BLOCK], neighbors[BLOCK];
};

// Return the bits of a float where a mask of bits is set.
inline float masked_float(float value, std::int32_t mask) {
    std::int32_t bits;
    std::memcpy(&bits, &value, 4);
    bits &= mask;
    std::memcpy(&value, &bits, 4);
    return value;
}

// Count the votes of the neighbors, row by row; `limits` holds for each distance in px, from 0 to half the window, by how much readings may
// differ; those farther away than `beyond`, m, may in proportion more, as they are farther away than the median. Loops of a fixed length
// without branches, to be vectorized: where readings do not agree, 0 is added.
WITH_AVX2 void count_votes(const float* own, Index pitch, const std::vector<float>& limits, float median, float beyond, Votes& votes) {
    const Index half_width = Index(limits.size()) - 1;
    float scale[BLOCK];
    for (Index i = 0; i < BLOCK; ++i) {
        scale[i] = own[i] > beyond ? own[i] / median : 1.0f;
        votes.total[i] = own[i];
        votes.agreeing[i] = votes.neighbors[i] = 0;
    }
    for (Index dy = -half_width; dy <= half_width; ++dy) {
        for (Index dx = -half_width; dx <= half_width; ++dx) {
            if (!dx && !dy) continue;
            const float limit = limits[std::max(std::abs(dx), std::abs(dy))];
            const float* other = own + dy * pitch + dx;
            for (Index i = 0; i < BLOCK; ++i) {
                const std::int32_t there = -std::int32_t(other[i] > 0);
                const std::int32_t agrees = there & -std::int32_t(std::fabs(other[i] - own[i]) < limit * scale[i]);
                votes.neighbors[i] -= there;
                votes.agreeing[i] -= agrees;
                votes.total[i] += double(masked_float(other[i], agrees));
            }
        }
    }
}

// The readings of the mask as an image of its box with some pixels without reading around it.
struct PaddedDepth {
    const FrameFacts& facts;
    Index pitch, padding;
    Zeros<float> image;

    PaddedDepth(const FrameFacts& facts, const float* depth, Index padding)
        : facts(facts), pitch(facts.columns() + 2 * padding), padding(padding), image((facts.rows() + 2 * padding) * pitch + BLOCK) {
        count_visits(facts.count);
        for (const Run& run : facts.runs) {
            const float* from = depth + run.row * facts.width;
            std::copy(from + run.start, from + run.end, at(run.row, run.start));
        }
    }
    ~PaddedDepth() {
        for (const Run& run : facts.runs) std::fill_n(at(run.row, run.start), run.size(), 0.0f);
    }

    float* at(Index row, Index column) {
        return image.data() + (row - facts.box.top + padding) * pitch + column - facts.box.left + padding;
    }
};

}  // namespace

DepthSummary summarize_depth(const FrameFacts& facts, const float* depth) {
    std::vector<float> readings, steps;
    count_visits(3 * facts.count);
    readings.reserve(facts.count);
    steps.reserve(facts.count);
    for (const Run& run : facts.runs) {
        const float* z = depth + run.row * facts.width;
        for (Index column = run.start; column < run.end; ++column) {
            if (!(z[column] > 0)) continue;
            readings.push_back(z[column]);
            if (column > run.start && z[column - 1] > 0) steps.push_back(std::fabs(z[column] - z[column - 1]));
        }
    }
    const auto middle = [](std::vector<float>& values) { return values.empty() ? 0.0f : median(std::move(values)); };
    const Index count = Index(readings.size());
    return {count, middle(readings), middle(steps)};
}

// Of independent errors, the first difference has twice and the second six times the variance of one; slopes raise the first, and
// errors that are correlated lower the second more. Of steps that are not 0 the lower quartile is one step of the quantization,
// wherever depth is so smooth that quantization hides its noise.
double inverse_depth_noise(const FrameFacts& facts, const float* depth, Index pixels) {
    std::vector<double> steps, bends, jumps;  // first and second differences, and the first ones that are not 0
    const std::size_t every = std::size_t(std::max<Index>(1, facts.count / pixels));
    Visits visits;
    for (std::size_t k = 0; k < facts.runs.size(); k += every) {
        const Run& run = facts.runs[k];
        const float* z = depth + run.row * facts.width;
        visits.count += 3 * (run.size());
        for (Index u = run.start + 1; u < run.end; ++u) {
            if (!(z[u - 1] > 0 && z[u] > 0)) continue;
            const double before = 1.0 / z[u - 1], own = 1.0 / z[u];
            steps.push_back(std::fabs(own - before));
            if (before != own) jumps.push_back(steps.back());
            if (u + 1 < run.end && z[u + 1] > 0) bends.push_back(std::fabs(before - 2 * own + 1.0 / z[u + 1]));
        }
    }
    if (jumps.empty()) return 0.0;
    const double quartile = value_at(jumps, jumps.size() / 4);
    const double noise = std::max(mean_of_smaller(steps) / std::sqrt(2.0), mean_of_smaller(bends) / std::sqrt(6.0));
    return std::hypot(noise / KEPT_MEAN, quartile / std::sqrt(12.0));
}

// Along the runs in blocks; the neighbors of a reading are added in row-major order.
AgreeingReadings agreeing_readings(const FrameFacts& facts, const float* depth, Agreement rule) {
    AgreeingReadings result;
    const Index half_width = std::min(rule.half_width, std::max(facts.rows(), facts.columns()));
    PaddedDepth masked(facts, depth, half_width);
    std::vector<float> limits(half_width + 1);
    for (Index distance = 0; distance <= half_width; ++distance) limits[distance] = least_float(rule.slope * double(distance));
    float nearest = rule.high;  // a limit that grew from the median on would let in noise of a whole step of the sensor in flat scenes
    facts.for_each_pixel([&](Index row, Index column) {
        const float own = *masked.at(row, column);
        if (own >= rule.low && own < nearest) nearest = own;
    });
    const float beyond = 2 * rule.median - nearest;
    Votes votes;
    count_visits(facts.count * (2 * half_width + 1) * (2 * half_width + 1));
    for (const Run& run : facts.runs) {
        for (Index start = run.start; start < run.end; start += BLOCK) {
            const Index count = std::min<Index>(BLOCK, run.end - start);
            const float* own = masked.at(run.row, start);
            count_votes(own, masked.pitch, limits, rule.median, beyond, votes);
            for (Index i = 0; i < count; ++i) {
                if (!(own[i] >= rule.low && own[i] <= rule.high)) continue;
                if (double(votes.agreeing[i]) < std::min(double(rule.min_agreeing), double(votes.neighbors[i]) / 2)) {
                    ++result.dropped;
                    continue;
                }
                result.pixels.insert(result.pixels.end(), {start + i, Index(run.row)});
                result.depth.push_back(own[i]);
                result.means.push_back(votes.total[i] / double(votes.agreeing[i] + 1));
            }
        }
    }
    return result;
}

namespace {

// A pixel without a reading, and where it is in an image of the box.
struct Empty {
    Index column, row, at;
};

}  // namespace

// Only pixels without a reading are looked at, in an image of the box that says which readings were kept and, later, which pixels lie
// far from all of them.
std::vector<Index> depth_holes(const FrameFacts& facts, const float* depth, const Index* kept, Index count, Index reach) {
    enum : Byte { EMPTY, KEPT, FAR };
    const Box& box = facts.box;
    reach = std::min(reach, std::max(facts.rows(), facts.columns()));
    const Index pitch = facts.columns() + 2 * reach;
    Zeros<Byte> zeros((facts.rows() + 2 * reach) * pitch);
    Byte* image = zeros.data();
    const auto at = [&](Index column, Index row) { return (row - box.top + reach) * pitch + column - box.left + reach; };
    const auto mark_kept = [&](Byte mark) {
        for (Index k = 0; k < count; ++k) {
            const Index u = kept[2 * k], v = kept[2 * k + 1];
            if (u >= box.left && u < box.right && v >= box.top && v < box.bottom) image[at(u, v)] = mark;
        }
    };
    mark_kept(KEPT);
    const auto has_near = [&](Index center, Byte wanted) {
        bool found = false;
        for (Index row = center - reach * pitch; row <= center + reach * pitch && !found; row += pitch) {
            found = std::memchr(image + row - reach, wanted, std::size_t(2 * reach + 1));
        }
        return found;
    };
    std::vector<Empty> empty;
    std::vector<Index> far, holes;
    count_visits(count + facts.count);
    facts.for_each_pixel([&](Index row, Index column) {
        const Index i = at(column, row);
        if (!(depth[row * facts.width + column] > 0) && image[i] != KEPT) empty.push_back({column, row, i});
    });
    for (const Empty& pixel : empty) {
        if (!has_near(pixel.at, KEPT)) far.push_back(pixel.at);
    }
    for (const Index i : far) image[i] = FAR;
    for (const Empty& pixel : empty) {
        if (!far.empty() && has_near(pixel.at, FAR)) holes.insert(holes.end(), {pixel.column, pixel.row});
    }
    for (const Index i : far) image[i] = 0;
    mark_kept(0);
    return holes;
}
