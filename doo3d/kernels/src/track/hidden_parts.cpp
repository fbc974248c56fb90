// Hidden parts of an object, carried over time from where they were seen last and are seen next.
#include "arrays.h"
#include "symmetric.h"

#include <algorithm>
#include <array>

namespace {

// Lengths of a hidden part at which a seen joint weighs a half where its turn is found: of 2,160 frames before stereo cameras 875 are
// right, 1,659 in the image; with 1 869 and 1,642; if all seen joints weigh the same 841 and 1,644.
constexpr double TURN_REACH = 2.0;

using Point = std::array<double, 3>;
using Turn = std::array<Point, 3>;

Point turned(const Turn& turn, const double* from, const double* to) {
    Point result;
    for (Index i = 0; i < 3; ++i) {
        result[i] = 0.0;
        for (Index j = 0; j < 3; ++j) result[i] += turn[i][j] * (to[j] - from[j]);
    }
    return result;
}

// Return the rotation of a product sum (a b') of positions b before and a after, about their middles, that turns b most nearly to a
// (Horn, J. Opt. Soc. Am. A 4, 1987).
Turn rotation(const double (&s)[3][3]) {
    double matrix[4][4] = {{s[0][0] + s[1][1] + s[2][2], s[2][1] - s[1][2], s[0][2] - s[2][0], s[1][0] - s[0][1]},
                           {0.0, s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[0][2] + s[2][0]},
                           {0.0, 0.0, s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]},
                           {0.0, 0.0, 0.0, s[2][2] - s[0][0] - s[1][1]}};
    for (Index i = 0; i < 4; ++i) {
        for (Index j = 0; j < i; ++j) matrix[i][j] = matrix[j][i];
    }
    double axes[4][4];
    diagonalize(matrix, axes);
    Index k = 0;
    for (Index i = 1; i < 4; ++i) k = matrix[i][i] > matrix[k][k] ? i : k;
    const double w = axes[0][k], x = axes[1][k], y = axes[2][k], z = axes[3][k];
    return {{{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}}};
}

// The joints (T, J, 3) of an object, and which of them the T frames show.
struct Frames {
    const double* joints;
    const Byte* seen;
    Index count, joints_per_frame;
    double segment;

    const double* joint(Index frame, Index k) const { return joints + (frame * joints_per_frame + k) * 3; }
    bool is_seen(Index frame, Index k) const { return seen[frame * joints_per_frame + k]; }
};

// A motion that keeps all lengths: points turn, and their middle moves.
struct Motion {
    Turn turn;
    Point before, after;

    Point moved(const double* point) const {
        Point result = turned(turn, before.data(), point);
        for (Index d = 0; d < 3; ++d) result[d] += after[d];
        return result;
    }
};

// Return how the joints beside the hidden ones, `first` to before `end`, move from one frame to another: a bend far off does not turn the
// hidden ones, and those next to them are too few to tell how a long part turns. Points a segment off along each axis do not turn: a
// straight line does not tell how far it turns round itself.
Motion motion_between(const Frames& frames, Index start, Index frame, Index first, Index end, Visits& visits) {
    std::vector<double> weights(frames.joints_per_frame, 0.0);
    double total = 0.0;
    for (Index k = 0; k < frames.joints_per_frame; ++k) {
        if (!frames.is_seen(start, k) || !frames.is_seen(frame, k)) continue;
        const double away = double(k < first ? first - k : k - end + 1) / (TURN_REACH * double(end - first)), squared = away * away;
        total += weights[k] = 1.0 / (1.0 + squared * squared);
    }
    visits.count += 2 * frames.joints_per_frame;
    Point before{}, after{};
    for (Index k = 0; k < frames.joints_per_frame; ++k) {
        for (Index d = 0; d < 3; ++d) {
            before[d] += frames.joint(start, k)[d] * weights[k] / total;
            after[d] += frames.joint(frame, k)[d] * weights[k] / total;
        }
    }
    double product[3][3] = {};
    for (Index d = 0; d < 3; ++d) product[d][d] = frames.segment * frames.segment;
    for (Index k = 0; k < frames.joints_per_frame; ++k) {
        const double *from = frames.joint(start, k), *to = frames.joint(frame, k);
        for (Index i = 0; i < 3; ++i) {
            for (Index j = 0; j < 3; ++j) product[i][j] += weights[k] * (to[i] - after[i]) * (from[j] - before[j]);
        }
    }
    return {rotation(product), before, after};
}

bool have_common(const Frames& frames, Index start, Index frame) {
    for (Index k = 0; k < frames.joints_per_frame; ++k) {
        if (frames.is_seen(start, k) && frames.is_seen(frame, k)) return true;
    }
    return false;
}

// A segment from one joint to the next, and its length: that of a mean of segments is the mean of theirs.
struct Segment {
    Point along{};
    double length = 0.0;

    void add(const Point& other, double weight) {
        for (Index d = 0; d < 3; ++d) along[d] += weight * other[d];
        length += weight * norm(other);
    }
    static double norm(const Point& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }
};

// Add the segments of the hidden joints `first` to before `end`, as they were in frame `start`, turned since.
void add_turned(const Frames& frames, Index start, const Turn& turn, Index first, Index end, double weight, Segment* segments) {
    for (Index k = first; k < end; ++k) segments[k].add(turned(turn, frames.joint(start, k), frames.joint(start, k + 1)), weight);
}

// Find the segments of the hidden joints `first` to before `end`, which were seen in frame `before` last and are in frame `after` next.
// Tell whether they are known from there.
bool carry(const Frames& frames, Index frame, Index first, Index end, Index before, Index after, Segment* segments, Visits& visits) {
    const bool has_before = before >= 0, has_after = after < frames.count;
    if (!has_before && !has_after) return false;
    if ((has_before && !have_common(frames, before, frame)) || (has_after && !have_common(frames, after, frame))) return false;
    const Index low = first > 0 && frames.is_seen(frame, first - 1) ? first - 1 : first, high = std::min(end, frames.joints_per_frame - 1);
    for (Index k = low; k < high; ++k) segments[k] = {};
    const double share = has_before && has_after ? double(frame - before) / double(after - before) : double(has_after);
    if (has_before) add_turned(frames, before, motion_between(frames, before, frame, first, end, visits).turn, low, high, 1 - share, segments);
    if (has_after) add_turned(frames, after, motion_between(frames, after, frame, first, end, visits).turn, low, high, share, segments);
    return true;
}

// Add to hidden joints between seen ones, `first` to before `end`, where they were in frame `start`, moved since as the joints beside them:
// all together, and each by what is left of the motion of the joints that both frames show before and after it.
void add_moved(const Frames& frames, Index start, Index frame, Index first, Index end, double weight, double* places, Visits& visits) {
    const Motion motion = motion_between(frames, start, frame, first, end, visits);
    visits.count += frames.joints_per_frame + end - first;
    std::vector<Index> common;
    std::vector<Point> left;
    for (Index k = 0; k < frames.joints_per_frame; ++k) {
        if (!frames.is_seen(start, k) || !frames.is_seen(frame, k)) continue;
        common.push_back(k);
        left.push_back(motion.moved(frames.joint(start, k)));
        for (Index d = 0; d < 3; ++d) left.back()[d] = frames.joint(frame, k)[d] - left.back()[d];
    }
    for (Index k = first; k < end; ++k) {
        const Index at = Index(std::lower_bound(common.begin(), common.end(), k) - common.begin());
        const Index before = std::max<Index>(at - 1, 0), after = std::min(at, Index(common.size()) - 1);
        const double gap = double(common[after] - common[before]), share = gap > 0 ? double(k - common[before]) / gap : 0.0;
        const Point moved = motion.moved(frames.joint(start, k));
        for (Index d = 0; d < 3; ++d) places[3 * k + d] += weight * (moved[d] + (1 - share) * left[before][d] + share * left[after][d]);
    }
}

// Place hidden joints between seen ones, `first` to before `end`, which were seen in frame `before` last and are in frame `after` next.
void place(const Frames& frames, Index frame, Index first, Index end, Index before, Index after, double* places, Visits& visits) {
    const bool has_before = before >= 0 && have_common(frames, before, frame), has_after = after < frames.count && have_common(frames, after, frame);
    if (!has_before && !has_after) return;
    std::fill(places + 3 * first, places + 3 * end, 0.0);
    const double share = has_before && has_after ? double(frame - before) / double(after - before) : double(has_after);
    if (has_before) add_moved(frames, before, frame, first, end, 1 - share, places, visits);
    if (has_after) add_moved(frames, after, frame, first, end, share, places, visits);
}

// Lay the hidden joints `first` to before `end`, which go on to one end of the object, along their segments from the seen joint beside them.
void lay(Index first, Index end, const Segment* segments, double* places) {
    const bool is_last = first > 0;
    for (Index n = 0; n < end - first; ++n) {
        const Index k = is_last ? first + n : end - 1 - n, beside = is_last ? k - 1 : k + 1;
        const Segment& segment = segments[std::min(k, beside)];
        const double factor = segment.length / std::max(Segment::norm(segment.along), 1e-12);
        for (Index d = 0; d < 3; ++d) places[3 * k + d] = places[3 * beside + d] + (is_last ? factor : -factor) * segment.along[d];
    }
}

// Return the joints (T, M, 3) m of an open object in successive frames with those that are hidden carried from other frames.
// A hidden joint between seen ones is where it was seen last, moved and turned since as the seen joints beside it; the same from when
// it is seen next, and both averaged by how near they are in time. An error of one place stays there. A hidden part that goes on to
// an end is laid along its segments, whose directions are averaged instead: that keeps its length, which averaged places do not.
// Joints that are never seen keep their shape, and all joints of a frame that shows nothing. segment: m, distance of neighboring
// joints; a straight part does not turn round itself, as if points that far off it had not turned.
auto carry_hidden(Volume<double> joints, Matrix<bool> seen, double segment) {
    const Index count = joints.shape(0), size = joints.shape(1);
    require(joints.shape(2) == 3, "joints do not have three coordinates");
    require(Index(seen.shape(0)) == count && Index(seen.shape(1)) == size, "seen is not one value per joint");
    require(segment > 0, "segment is not positive");
    const Frames frames{joints.data(), bytes_of(seen), count, size, segment};
    std::vector<double> result(joints.data(), joints.data() + count * size * 3);
    for (const double value : result) require(std::isfinite(value), "a coordinate is not finite");
    std::vector<Index> last(size, -1), later(count * size, count);
    for (Index frame = count - 1; frame >= 0; --frame) {
        for (Index k = 0; k < size; ++k) {
            const Index next = frame + 1 < count ? later[(frame + 1) * size + k] : count;
            later[frame * size + k] = frames.is_seen(frame, k) ? frame : next;
        }
    }
    Visits visits{2 * count * size};
    for (Index frame = 0; frame < count; ++frame) {
        const Index* next = later.data() + frame * size;
        for (Index k = 0; k < size; ++k) last[k] = frames.is_seen(frame, k) ? frame : last[k];
        std::vector<Segment> segments(size);
        for (Index k = 0; k + 1 < size; ++k) {
            Point along;
            for (Index d = 0; d < 3; ++d) along[d] = frames.joint(frame, k + 1)[d] - frames.joint(frame, k)[d];
            segments[k].add(along, 1.0);
        }
        double* places = result.data() + frame * size * 3;
        for (Index first = 0, end = 0; first < size; first = end) {
            end = first + 1;
            if (frames.is_seen(frame, first)) continue;
            while (end < size && !frames.is_seen(frame, end)) ++end;
            const bool is_between = first > 0 && end < size;
            bool is_carried = false;
            for (Index low = first, high = first; low < end; low = high) {
                while (high < end && last[high] == last[low] && next[high] == next[low]) ++high;
                if (is_between) {
                    place(frames, frame, low, high, last[low], next[low], places, visits);
                } else {
                    is_carried |= carry(frames, frame, low, high, last[low], next[low], segments.data(), visits);
                }
            }
            if (is_carried) lay(first, end, segments.data(), places);
        }
    }
    return shaped(std::move(result), count, size, 3);
}

}  // namespace

void bind_hidden_parts(Module& m) {
    // Return the joints of an object in successive frames, with those that a frame hides carried from other frames.
    //
    // A hidden joint between seen ones is where it was seen last, moved since as the joints beside it that both frames show: turned
    // together (Horn, J. Opt. Soc. Am. A 4, 1987), and by what they moved besides, in between linearly. The same from when it is
    // seen next, and the mean of both by how near they are in time. So an error of one place stays there.
    //
    // Hidden joints that go on to an end of the object are laid along segments from the seen joint beside them, whose directions are
    // found in the same way: that keeps their length, which the mean of positions does not, and nothing beyond tells it.
    //
    // Joints that are never seen keep their shape, and all joints of a frame that shows none of those of another.
    //
    // Parameters
    // ----------
    // joints
    //     (T, J, 3) float64 m, the joints of T frames
    // seen
    //     (T, J) bool
    // segment
    //     m, length of a segment: as if points so far off along each axis had not turned
    //
    // Returns
    // -------
    // (T, J, 3) float64 m
    m.def("carry_hidden", &carry_hidden, "joints"_array, "seen"_array, "segment"_a);
}
