// Chords of one length along polylines.
#include "order_statistics.h"
#include "polyline.h"

namespace {

// Joints (J, D), and the position of each along the polyline (J,).
struct Chords {
    std::vector<double> joints, arc_lengths;
    Index dim;
    Index size() const { return Index(arc_lengths.size()); }
};

// Lay chords of exactly `length` along points (P, D).
//
// A chord ends where the polyline first leaves the sphere of radius `length` about the chord's start. The end is scaled to lie
// on the sphere exactly, so that rounding does not add up. What is left of the polyline after the last whole chord has no joint.
Chords lay(const double* points, Index count, Index dim, double length) {
    Chords chords{std::vector<double>(points, points + dim), {0.0}, dim};
    std::vector<double> position(points, points + dim), start(position), end(dim);
    double passed = 0.0;  // arc length at the point before
    for (Index i = 1; i < count;) {
        const double* point = points + i * dim;
        double square = 0.0, step2 = 0.0, half = 0.0, inside = length * length;
        for (Index d = 0; d < dim; ++d) {
            const double offset = position[d] - start[d], step = point[d] - position[d], away = point[d] - start[d];
            square += away * away;
            step2 += step * step;
            half += step * offset;
            inside -= offset * offset;
        }
        if (std::sqrt(square) < length) {
            passed += std::sqrt(squared_distance(point, point - dim, dim));
            position.assign(point, point + dim);
            ++i;
            continue;
        }
        // the larger root of |position + t (point - position) - start|^2 = length^2
        const double t = least(1.0, (std::sqrt(half * half + step2 * most(inside, 0.0)) - half) / step2);
        double norm = 0.0;
        for (Index d = 0; d < dim; ++d) {
            position[d] += t * (point[d] - position[d]);
            const double away = position[d] - start[d];
            norm += away * away;
        }
        for (Index d = 0; d < dim; ++d) end[d] = start[d] + (position[d] - start[d]) * length / std::sqrt(norm);
        chords.joints.insert(chords.joints.end(), end.begin(), end.end());
        position = start = end;
        chords.arc_lengths.push_back(passed + std::sqrt(squared_distance(position.data(), point - dim, dim)));
    }
    count_visits(count + chords.size());
    return chords;
}

// Refuse lengths of which more than 1e8 would be laid.
void check_length(const std::vector<double>& points, Index count, Index dim, double length) {
    double total = 0.0;
    for (Index i = 1; i < count; ++i) total += std::sqrt(squared_distance(&points[i * dim], &points[(i - 1) * dim], dim));
    require(length > 0 && total / length < 1e8, "length is not positive, or the polyline is over 1e8 times as long");
}

auto lay_equal_chords(StridedMatrix<double> polyline, double length) {
    const Index count = polyline.shape(0), dim = polyline.shape(1);
    const std::vector<double> points = finite_points(polyline);
    check_length(points, count, dim, length);
    Chords chords = lay(points.data(), count, dim, length);
    return std::make_tuple(rows_of(std::move(chords.joints), dim), std::move(chords.arc_lengths));
}

// Return the polyline from the arc length `start` on.
std::vector<double> cut_before(const double* points, Index count, Index dim, const std::vector<double>& arc_lengths, double start) {
    const Index after = std::upper_bound(arc_lengths.begin(), arc_lengths.end(), start) - arc_lengths.begin();
    const Index edge = std::max<Index>(1, std::min(count - 1, after));
    const double step = arc_lengths[edge] - arc_lengths[edge - 1];
    const double t = step > 0 ? (start - arc_lengths[edge - 1]) / step : 0.0;
    std::vector<double> rest(dim);
    for (Index d = 0; d < dim; ++d) {
        const double before = points[(edge - 1) * dim + d];
        rest[d] = before + (points[edge * dim + d] - before) * t;
    }
    rest.insert(rest.end(), points + edge * dim, points + count * dim);
    return rest;
}

// The chords are laid four times. The first time, from the curve's beginning, fixes their number. Each time the start is then
// moved by half of what the last joint is beyond the curve's end, or short of it, so that the excess is the same at both ends. There
// are no joints where the curve curls up so that no chord fits.
std::vector<double> cover(const std::vector<double>& points, Index dim, double length) {
    const Index count = Index(points.size()) / dim;
    check_length(points, count, dim, length);
    const std::vector<double> along = arc_lengths(points, dim);
    const double total = along.back() - 2 * length;
    Chords chords;
    double start = length;
    Index chord_count = 0;
    for (int round = 0; round < 4; ++round) {
        const std::vector<double> rest = cut_before(points.data(), count, dim, along, start);
        chords = lay(rest.data(), Index(rest.size()) / dim, dim, length);
        for (double& at : chords.arc_lengths) at += start - length;
        const std::vector<double>& at = chords.arc_lengths;
        if (chord_count == 0) {
            const Index last = std::upper_bound(at.begin(), at.end(), total) - at.begin() - 1;
            require(last >= 0, "the curve is shorter than no length at all");
            chord_count = std::max<Index>(1, Index(std::nearbyint(double(last) + (total - at[last]) / length)));
        }
        chord_count = std::min(chord_count, chords.size() - 1);
        if (chord_count == 0) return {};
        const double shift = start - length - (start - length + at[chord_count] - total) / 2;
        start = length + least(most(shift, -length / 2), length / 2);
    }
    chords.joints.resize((chord_count + 1) * dim);
    return chords.joints;
}

// Move a curve outwards at its bends, so that chords laid on it lie about the given curve: by length^2 / 12R at a bend of radius R, the mean
// distance of a chord from its arc, at most length / 24. The ends stay. Where over `most_samples` points lie on a chord, the bend is taken
// from points a quarter of a chord apart, since their noise would be multiplied by the square of that ratio.
void compensate_sagitta(std::vector<double>& points, Index dim, double length, double most_samples) {
    const Index count = Index(points.size()) / dim;
    std::vector<double> steps, bend(points.size());
    for (Index i = 1; i < count; ++i) {
        steps.push_back(std::sqrt(squared_distance(points.data() + i * dim, points.data() + (i - 1) * dim, dim)));
    }
    const double spacing = count < 3 ? 0.0 : median(std::move(steps));
    if (!(spacing > 0)) return;
    const bool is_dense = !(length <= most_samples * spacing);
    const double quarter = std::nearbyint(length / spacing / 4), half = double((count - 1) / 2);
    const Index apart = is_dense ? Index(most(1.0, least(quarter, half))) : 1;
    const double square = (double(apart) * spacing) * (double(apart) * spacing);
    for (Index i = 1; i + 1 < count; ++i) {
        const Index at = std::min(std::max(i, apart), count - 1 - apart);
        const double *middle = points.data() + at * dim, *before = middle - apart * dim, *after = middle + apart * dim;
        for (Index d = 0; d < dim; ++d) bend[i * dim + d] = (after[d] - 2 * middle[d] + before[d]) / square;
    }
    for (Index i = 0; i < count; ++i) {
        double curvature = 0.0;
        for (Index d = 0; d < dim; ++d) curvature += bend[i * dim + d] * bend[i * dim + d];
        const double damping = most(1.0, 2 * length * std::sqrt(curvature));
        for (Index d = 0; d < dim; ++d) points[i * dim + d] -= length * length / 12 * bend[i * dim + d] / damping;
    }
}

// Append a point straight ahead of the last one; it coincides with that where the last two do.
void extend(std::vector<double>& points, Index dim, double shift) {
    const double *last = points.data() + points.size() - dim, *before = last - dim;
    const double norm = std::sqrt(squared_distance(last, before, dim));
    std::vector<double> ahead(last, last + dim);
    for (Index d = 0; d < dim; ++d) ahead[d] += shift * (norm > 0 ? (last[d] - before[d]) / norm : 0.0);
    points.insert(points.end(), ahead.begin(), ahead.end());
}

// Lengthen a polyline straight ahead at its last point, or shorten it by a negative shift; the first segment always stays.
void shift_end(std::vector<double>& points, Index dim, double shift) {
    if (shift >= 0) return extend(points, dim, shift);
    const std::vector<double> along = arc_lengths(points, dim);
    const double end = most(along.back() + shift, along[1]);
    std::vector<double> place(dim);
    place_at([&](Index i, Index d) { return points[i * dim + d]; }, along, end, dim, place.data());
    points.resize((std::lower_bound(along.begin(), along.end(), end) - along.begin()) * dim);
    points.insert(points.end(), place.begin(), place.end());
}

// Lay joints along a polyline from end to end; none on one shorter than half a segment, or curled up within one.
std::vector<double> cover_from_end_to_end(std::vector<double> points, Index dim, double length) {
    const std::vector<double> along = arc_lengths(points, dim);
    if (along.back() < length / 2) return {};
    const auto is_same = [&](Index i, Index j) {
        return !(squared_distance(points.data() + i * dim, points.data() + j * dim, dim) > 0);
    };
    // an end that is repeated has no direction to continue in
    Index first = 0, last = Index(along.size()) - 1;
    while (first + 1 < last && is_same(first, first + 1)) ++first;
    while (last - 1 > first && is_same(last - 1, last)) --last;
    points = std::vector<double>(points.begin() + first * dim, points.begin() + (last + 1) * dim);
    for (int end = 0; end < 2; ++end) {
        extend(points, dim, length);
        points = reversed(points, dim);
    }
    return cover(points, dim, length);
}

auto equal_segments(Matrix<double> points, Vector<Index> bounds, Vector<bool> closed, Vector<double> shifts, double length,
                    double most_samples) {
    const Index dim = points.shape(1), lines = Index(closed.shape(0));
    check_bounds(bounds, points.shape(0));
    require(Index(bounds.shape(0)) == lines + 1 && Index(shifts.shape(0)) == 2 * lines, "bounds, closed and shifts do not fit each other");
    require(dim > 0 && length > 0, "points have no coordinates, or length is not positive");
    std::vector<double> joints;
    std::vector<Index> starts{0};
    for (Index c = 0; c < lines; ++c) {
        std::vector<double> line(points.data() + bounds(c) * dim, points.data() + bounds(c + 1) * dim);
        for (const double value : line) require(std::isfinite(value), "a coordinate is not finite");
        require(std::isfinite(shifts(2 * c)) && std::isfinite(shifts(2 * c + 1)), "a shift is not finite");
        count_visits(Index(line.size()) / dim);
        if (!closed(c) && Index(line.size()) > dim) {
            if (most_samples > 0) compensate_sagitta(line, dim, length, most_samples);
            shift_end(line, dim, shifts(2 * c + 1));
            line = reversed(line, dim);
            shift_end(line, dim, shifts(2 * c));
            const std::vector<double> laid = cover_from_end_to_end(reversed(line, dim), dim, length);
            joints.insert(joints.end(), laid.begin(), laid.end());
        }
        starts.push_back(Index(joints.size()) / dim);
    }
    return std::make_tuple(rows_of(std::move(joints), dim), std::move(starts));
}

}  // namespace

void bind_equal_chords(Module& m) {
    // Lay chords of exactly `length` along a polyline, the first from its first point.
    //
    // A chord ends where the polyline first is farther than `length` from the chord's start. The rest of the polyline after the last
    // whole chord has no joint.
    //
    // Parameters
    // ----------
    // points
    //     (P, D) float64, P >= 1
    // length
    //     length of a chord, in the unit of the points
    //
    // Returns
    // -------
    // joints : (J, D) float64, the J >= 1 joints of the J - 1 chords; only the first point if the polyline is too short for a chord
    // arc_lengths : (J,) float64, the position of each joint along the polyline, from its first point
    m.def("lay_equal_chords", &lay_equal_chords, "points"_array, "length"_a);
    // Lay chains of segments of exactly `length` along polylines, each from end to end.
    //
    // The whole number of segments that fits best is used. A chain is longer or shorter than its polyline by the same length at
    // both ends; where it is longer, it continues straight.
    //
    // Parameters
    // ----------
    // points
    //     (P, D) float64, the points of L polylines, one polyline after the other
    // bounds
    //     (L + 1,) int64, row of the first point of each polyline; the last entry is P
    // closed
    //     (L,) bool, True for a ring, along which no chain is laid
    // shifts
    //     (2 L,) float64, length by which each polyline is lengthened straight ahead at its first and at its last point first;
    //     negative shortens it, the segment at the other end always stays
    // length
    //     length of a segment, in the unit of the points
    // most_samples
    //     0 lays chords on the polyline itself, inside of its bends. Otherwise the points, evenly spaced, are moved outwards first:
    //     by length^2 / 12 R at a bend of radius R, two thirds of the sagitta of a chord, at most length / 24. Where more points
    //     than this lie on a chord, bends are taken from points a quarter of a chord apart
    //
    // Returns
    // -------
    // joints : (J, D) float64, the joints of all chains, one chain after the other
    // bounds : (L + 1,) int64, row of the first joint of each chain; none for a ring and where a polyline is shorter than half a
    //     segment or curled up within one
    m.def("equal_segments", &equal_segments, "points"_array, "bounds"_array, "closed"_array, "shifts"_array, "length"_a, "most_samples"_a);
}
