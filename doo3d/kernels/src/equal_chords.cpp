// Chords of one length along polylines.
#include "arrays.h"

#include <algorithm>

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
    const Index size = chords.size();
    return std::make_tuple(to_numpy(std::move(chords.joints), size, dim), to_numpy(std::move(chords.arc_lengths)));
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
// moved by half of what the last joint is beyond the curve's end, or short of it, so that the excess is the same at both ends.
auto cover_with_chords(StridedMatrix<double> polyline, double length) {
    const Index count = polyline.shape(0), dim = polyline.shape(1);
    const std::vector<double> points = finite_points(polyline);
    require(count > 1, "points hold fewer than two, expected a polyline");
    check_length(points, count, dim, length);
    std::vector<double> arc_lengths(count);
    for (Index i = 1; i < count; ++i) {
        const double* point = points.data() + i * dim;
        arc_lengths[i] = arc_lengths[i - 1] + std::sqrt(squared_distance(point, point - dim, dim));
    }
    const double total = arc_lengths.back() - 2 * length;
    Chords chords;
    double start = length;
    Index chord_count = 0;
    for (int round = 0; round < 4; ++round) {
        const std::vector<double> rest = cut_before(points.data(), count, dim, arc_lengths, start);
        chords = lay(rest.data(), Index(rest.size()) / dim, dim, length);
        for (double& at : chords.arc_lengths) at += start - length;
        const std::vector<double>& at = chords.arc_lengths;
        if (chord_count == 0) {
            const Index last = std::upper_bound(at.begin(), at.end(), total) - at.begin() - 1;
            require(last >= 0, "the curve is shorter than no length at all");
            chord_count = std::max<Index>(1, Index(std::nearbyint(double(last) + (total - at[last]) / length)));
        }
        chord_count = std::min(chord_count, chords.size() - 1);
        const double shift = start - length - (start - length + at[chord_count] - total) / 2;
        start = length + least(most(shift, -length / 2), length / 2);
    }
    chords.joints.resize((chord_count + 1) * dim);
    return to_numpy(std::move(chords.joints), chord_count + 1, dim);
}

}  // namespace

void bind_equal_chords(nb::module_& m) {
    m.def("lay_equal_chords", &lay_equal_chords, "points"_a.noconvert(), "length"_a);
    m.def("cover_with_chords", &cover_with_chords, "points"_a.noconvert(), "length"_a);
}
