// Hidden parts of an object, carried over time from where they were seen last and are seen next.
#include "arrays.h"
#include "symmetric.h"
#include "vector3.h"

namespace {

// Lengths of a hidden part at which a seen joint weighs a half where its turn is found: of 2,160 frames before stereo cameras 875 are
// right, 1,659 in the image; with 1 869 and 1,642; if all seen joints weigh the same 841 and 1,644.
constexpr double TURN_REACH = 2.0;

using Turn = std::array<Vec, 3>;

Vec turned(const Turn& turn, const double* from, const double* to) {
    Vec result{};
    for (Index i = 0; i < 3; ++i) {
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
    Index count, size;
    double segment;

    const double* joint(Index frame, Index k) const { return joints + (frame * size + k) * 3; }
    bool is_seen(Index frame, Index k) const { return seen[frame * size + k]; }
    // Return the first joint from one on that two frames show; the number of joints if there is none.
    Index next_common(Index frame, Index other, Index k) const {
        while (k < size && !(is_seen(frame, k) && is_seen(other, k))) ++k;
        return k;
    }
    bool have_common(Index frame, Index other) const { return next_common(frame, other, 0) < size; }
};

// Joints that are hidden in a frame, `first` to before `end`, which were seen in frame `before` last (-1 for none) and are in frame `after`
// next (the number of frames for none).
struct Hidden {
    Index frame, first, end, before, after;
};

// A motion that keeps all lengths: points turn, and their middle moves.
struct Motion {
    Turn turn;
    Vec before, after;

    Vec moved(const double* point) const { return plus(turned(turn, before.data(), point), after, 1.0); }
};

// Return how the joints beside the hidden ones move from frame `start`: a bend far off does not turn the hidden ones, and those next to them
// are too few to tell how a long part turns. Points a segment off along each axis do not turn: a straight line does not tell how far it
// turns round itself.
Motion motion_since(const Frames& frames, Index start, const Hidden& part) {
    std::vector<double> weights(frames.size);
    double total = 0.0;
    const auto next = [&](Index k) { return frames.next_common(start, part.frame, k); };
    for (Index k = next(0); k < frames.size; k = next(k + 1)) {
        const double away = double(k < part.first ? part.first - k : k - part.end + 1) / (TURN_REACH * double(part.end - part.first));
        const double squared = away * away;
        total += weights[k] = 1.0 / (1.0 + squared * squared);
    }
    count_visits(2 * frames.size);
    Vec before{}, after{};
    for (Index k = 0; k < frames.size; ++k) {
        for (Index d = 0; d < 3; ++d) {
            before[d] += frames.joint(start, k)[d] * weights[k] / total;
            after[d] += frames.joint(part.frame, k)[d] * weights[k] / total;
        }
    }
    double product[3][3] = {};
    for (Index d = 0; d < 3; ++d) product[d][d] = frames.segment * frames.segment;
    for (Index k = 0; k < frames.size; ++k) {
        const double *from = frames.joint(start, k), *to = frames.joint(part.frame, k);
        for (Index i = 0; i < 3; ++i) {
            for (Index j = 0; j < 3; ++j) product[i][j] += weights[k] * (to[i] - after[i]) * (from[j] - before[j]);
        }
    }
    return {rotation(product), before, after};
}

// A segment from one joint to the next, and its length: that of a mean of segments is the mean of theirs.
struct Segment {
    Vec along{};
    double length = 0.0;

    void add(const Vec& other, double weight) {
        along = plus(along, other, weight);
        length += weight * norm(other);
    }
};

// Call `add` with each of the frames from which a part is known, before and after it, and the weight of that frame: by how near it is in time.
template <class Add>
void for_each_side(const Hidden& part, bool has_before, bool has_after, Add add) {
    const double share = has_before && has_after ? double(part.frame - part.before) / double(part.after - part.before) : double(has_after);
    if (has_before) add(part.before, 1 - share);
    if (has_after) add(part.after, share);
}

// Find the segments of hidden joints, turned since they were seen. Tell whether they are known from there.
bool carry(const Frames& frames, const Hidden& part, std::vector<Segment>& segments) {
    const bool has_before = part.before >= 0, has_after = part.after < frames.count;
    if (!has_before && !has_after) return false;
    if (has_before && !frames.have_common(part.before, part.frame)) return false;
    if (has_after && !frames.have_common(part.after, part.frame)) return false;
    const Index low = part.first > 0 && frames.is_seen(part.frame, part.first - 1) ? part.first - 1 : part.first;
    const Index high = std::min(part.end, frames.size - 1);
    std::fill(segments.begin() + low, segments.begin() + std::max(low, high), Segment());
    for_each_side(part, has_before, has_after, [&](Index start, double weight) {
        const Turn turn = motion_since(frames, start, part).turn;
        for (Index k = low; k < high; ++k) segments[k].add(turned(turn, frames.joint(start, k), frames.joint(start, k + 1)), weight);
    });
    return true;
}

// Add to hidden joints between seen ones where they were in frame `start`, moved since as the joints beside them: all together, and each by
// what is left of the motion of the joints that both frames show before and after it.
void add_moved(const Frames& frames, Index start, const Hidden& part, double weight, double* places) {
    const Motion motion = motion_since(frames, start, part);
    count_visits(frames.size + part.end - part.first);
    std::vector<Index> common;
    std::vector<Vec> left;
    const auto next = [&](Index k) { return frames.next_common(start, part.frame, k); };
    for (Index k = next(0); k < frames.size; k = next(k + 1)) {
        common.push_back(k);
        left.push_back(minus(vec(frames.joint(part.frame, k)), motion.moved(frames.joint(start, k))));
    }
    for (Index k = part.first; k < part.end; ++k) {
        const Index at = Index(std::lower_bound(common.begin(), common.end(), k) - common.begin());
        const Index before = std::max<Index>(at - 1, 0), after = std::min(at, Index(common.size()) - 1);
        const double gap = double(common[after] - common[before]), share = gap > 0 ? double(k - common[before]) / gap : 0.0;
        const Vec moved = motion.moved(frames.joint(start, k));
        for (Index d = 0; d < 3; ++d) places[3 * k + d] += weight * (moved[d] + (1 - share) * left[before][d] + share * left[after][d]);
    }
}

// Place hidden joints between seen ones.
void place(const Frames& frames, const Hidden& part, double* places) {
    const bool has_before = part.before >= 0 && frames.have_common(part.before, part.frame);
    const bool has_after = part.after < frames.count && frames.have_common(part.after, part.frame);
    if (!has_before && !has_after) return;
    std::fill(places + 3 * part.first, places + 3 * part.end, 0.0);
    for_each_side(part, has_before, has_after, [&](Index start, double weight) { add_moved(frames, start, part, weight, places); });
}

// Lay the hidden joints `first` to before `end`, which go on to one end of the object, along their segments from the seen joint beside them.
void lay(Index first, Index end, const std::vector<Segment>& segments, double* places) {
    const bool is_last = first > 0;
    for (Index n = 0; n < end - first; ++n) {
        const Index k = is_last ? first + n : end - 1 - n, beside = is_last ? k - 1 : k + 1;
        const Segment& segment = segments[std::min(k, beside)];
        const double factor = segment.length / std::max(norm(segment.along), 1e-12);
        for (Index d = 0; d < 3; ++d) places[3 * k + d] = places[3 * beside + d] + (is_last ? factor : -factor) * segment.along[d];
    }
}

// Carry the hidden joints of a frame, stretch by stretch: `last` and `next` are the frames in which each joint is seen.
void carry_frame(const Frames& frames, Index frame, const Index* last, const Index* next, double* places) {
    std::vector<Segment> segments(frames.size);
    for (Index k = 0; k + 1 < frames.size; ++k) {
        segments[k].add(minus(vec(frames.joint(frame, k + 1)), vec(frames.joint(frame, k))), 1.0);
    }
    for (Index first = 0, end = 0; first < frames.size; first = end) {
        end = first + 1;
        if (frames.is_seen(frame, first)) continue;
        while (end < frames.size && !frames.is_seen(frame, end)) ++end;
        bool is_carried = false;
        for (Index low = first, high = first; low < end; low = high) {
            while (high < end && last[high] == last[low] && next[high] == next[low]) ++high;
            const Hidden part{frame, low, high, last[low], next[low]};
            if (first > 0 && end < frames.size) {
                place(frames, part, places);
            } else {
                is_carried |= carry(frames, part, segments);
            }
        }
        if (is_carried) lay(first, end, segments, places);
    }
}

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
    count_visits(2 * count * size);
    for (Index frame = 0; frame < count; ++frame) {
        for (Index k = 0; k < size; ++k) last[k] = frames.is_seen(frame, k) ? frame : last[k];
        carry_frame(frames, frame, last.data(), later.data() + frame * size, result.data() + frame * size * 3);
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
