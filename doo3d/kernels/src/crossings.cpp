// Crossings of polylines in the plane, and values along polylines.
#include "cells.h"
#include "polyline.h"

#include <cstdlib>

namespace {

// A step of a polyline from one point to the next.
struct Segment {
    const double* start;
    double step[2];
    Index line, number;
};

double cross(const double* a, const double* b) { return a[0] * b[1] - a[1] * b[0]; }

// Return the angle between two lines, 0 to pi / 2.
double angle_between(const double* a, const double* b) {
    const double size = std::sqrt(a[0] * a[0] + a[1] * a[1]) * std::sqrt(b[0] * b[0] + b[1] * b[1]);
    return std::asin(std::min(std::fabs(cross(a, b)) / size, 1.0));
}

// Return the segments whose points are finite.
std::vector<Segment> visible_segments(const Matrix<double>& points, const Vector<Index>& bounds) {
    std::vector<Segment> segments;
    for (std::size_t c = 0; c + 1 < bounds.shape(0); ++c) {
        for (Index i = bounds(c); i + 1 < bounds(c + 1); ++i) {
            const double* start = points.data() + 2 * i;
            const Segment segment{start, {start[2] - start[0], start[3] - start[1]}, Index(c), i - bounds(c)};
            const double sum = start[0] + start[1] + segment.step[0] + segment.step[1];
            if (std::isfinite(sum)) segments.push_back(segment);
        }
    }
    return segments;
}

// Segments that cross have middles that are not farther apart than the longest is long.
auto polyline_crossings(Matrix<double> points, Vector<Index> bounds, Vector<bool> closed) {
    require(points.shape(1) == 2, "points are not (J, 2)");
    check_bounds(bounds, points.shape(0));
    require(closed.shape(0) + 1 == bounds.shape(0), "closed is not one per polyline");
    std::vector<Index> lines, numbers, others;
    std::vector<double> places, middles, angles, points_at;
    const std::vector<Segment> segments = visible_segments(points, bounds);
    double square = 0.0;
    for (const Segment& segment : segments) {
        for (Index d = 0; d < 2; ++d) middles.push_back(segment.start[d] + segment.step[d] / 2);
        square = std::max(square, segment.step[0] * segment.step[0] + segment.step[1] * segment.step[1]);
    }
    const double reach = 1.000001 * std::sqrt(square);
    const auto are_apart = [&](const Segment& one, const Segment& other) {
        if (one.line != other.line) return true;
        const Index gap = std::abs(one.number - other.number), count = bounds(one.line + 1) - bounds(one.line) - 1;
        return (closed(one.line) ? std::min(gap, count - gap) : gap) > 1;
    };
    const auto place = [&](const Segment& one, const Segment& other, double* t) {
        const double offset[2] = {other.start[0] - one.start[0], other.start[1] - one.start[1]}, sine = cross(one.step, other.step);
        if (sine == 0) return false;
        t[0] = cross(offset, other.step) / sine;
        t[1] = cross(offset, one.step) / sine;
        return t[0] >= 0 && t[0] < 1 && t[1] >= 0 && t[1] < 1;
    };
    if (reach > 0 && std::isfinite(reach)) {
        nb::gil_scoped_release released;
        const Cells cells(middles.data(), Index(segments.size()), 2, reach / CELLS_PER_REACH);
        for (Index i = 0; i < Index(segments.size()); ++i) {
            others.clear();
            double t[2];
            cells.for_each_around(&middles[2 * i], reach, [&](Index k) {
                const Index j = cells.order[k];
                if (j > i && are_apart(segments[i], segments[j]) && place(segments[i], segments[j], t)) others.push_back(j);
            });
            std::sort(others.begin(), others.end());
            for (const Index j : others) {
                place(segments[i], segments[j], t);
                lines.insert(lines.end(), {segments[i].line, segments[j].line});
                numbers.insert(numbers.end(), {segments[i].number, segments[j].number});
                places.insert(places.end(), {t[0], t[1]});
                angles.push_back(angle_between(segments[i].step, segments[j].step));
                for (Index d = 0; d < 2; ++d) points_at.push_back(segments[i].start[d] + t[0] * segments[i].step[d]);
            }
        }
    }
    const std::size_t count = lines.size() / 2;
    return std::make_tuple(to_numpy(std::move(lines), count, 2), to_numpy(std::move(numbers), count, 2), to_numpy(std::move(places), count, 2),
                           to_numpy(std::move(angles)), to_numpy(std::move(points_at), count, 2));
}

}  // namespace

void bind_crossings(Module& m) {
    // Find every place where two segments of L polylines in the plane cross. Neighbors, which share a point, do not count.
    //
    // Parameters
    // ----------
    // points, bounds
    //     (J, 2) float64, the points of all polylines, one after the other, and (L + 1,) int64, the first of each; segments with a
    //     point that is not finite are left out
    // closed
    //     (L,) bool, True if the last point of a polyline repeats its first
    //
    // Returns
    // -------
    // line, segment : (C, 2) int64, polyline and segment of both segments at each of C crossings, in order of the first segment,
    //     then of the second
    // t : (C, 2) float64, position of the crossing along each, from 0 to 1
    // angle : (C,) float64 rad between the two, 0 to pi / 2
    // point : (C, 2) float64, position of the crossing
    m.def("polyline_crossings", &polyline_crossings, "points"_a.noconvert(), "bounds"_a.noconvert(), "closed"_a.noconvert());
}
