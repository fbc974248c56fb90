// Gaps between chain ends along which the object is seen: two ends follow each other on one line of the mask's skeleton.
#include "image.h"
#include "nearest.h"
#include "polyline.h"

namespace {

// The nearest target of each point within reach; -1 without one.
std::vector<Index> nearest_within(const std::vector<double>& points, const std::vector<double>& targets, double reach) {
    const Index count = Index(points.size()) / 2;
    NearestOfPoints found(points.data(), count, targets.data(), Index(targets.size()) / 2, 2, reach);
    for (Index i = 0; i < count; ++i) {
        if (!std::isfinite(found.distance[i])) found.index[i] = -1;
    }
    return found.index;
}

// Samples along chains in the image, at most half the reach apart, and the chain of each.
struct Samples {
    std::vector<double> points;
    std::vector<Index> chain;

    Samples(const Matrix<double>& joints, const Vector<Index>& bounds, const Camera& camera, double reach) {
        std::vector<double> seen(2 * joints.shape(0));
        for (Index i = 0; i < Index(joints.shape(0)); ++i) camera.project(joints.data() + 3 * i, &seen[2 * i]);
        for (Index c = 0; c + 1 < Index(bounds.shape(0)); ++c) {
            const std::vector<double> line(seen.begin() + 2 * bounds(c), seen.begin() + 2 * bounds(c + 1));
            const std::vector<double> along = arc_lengths(line, 2);
            if (line.empty() || !(along.back() / reach < 1e6)) continue;
            const Index count = 2 + Index(2 * along.back() / reach);
            const double spacing = along.back() / double(count - 1);
            for (Index k = 0; k < count; ++k) {
                double place[2];
                const double at = k == count - 1 ? along.back() : double(k) * spacing;
                place_at([&](Index i, Index d) { return line[2 * i + d]; }, along, at, 2, place);
                points.insert(points.end(), {place[0], place[1]});
                chain.push_back(c);
            }
        }
        count_visits(Index(chain.size()));
    }
};

// Tell whether a line (P, 2) px between two ends is at least so long, and each end points along its first stretch so long.
bool faces(const std::vector<double>& line, const double* from, const double* to, double least) {
    const std::vector<double> along = arc_lengths(line, 2);
    const Index last = Index(along.size()) - 1;
    if (last < 1 || along[last] < least) return false;
    const auto ahead = [&](Index start, Index place, const double* direction) {
        return (line[2 * place] - line[2 * start]) * direction[0] + (line[2 * place + 1] - line[2 * start + 1]) * direction[1] > 0;
    };
    Index first = 0, back = last;  // the point before the first one so far along, and the last one so far from the end
    while (first < last - 1 && along[first + 1] < least) ++first;
    while (back > 0 && along[last] - along[back] < least) --back;
    return back > 0 && ahead(0, first, from) && ahead(last, back - 1, to);
}

// Append the points (P, 3) m of a line (P, 2) px between two ends: its inverse depth changes evenly.
void add_lifted(const std::vector<double>& line, const double* start, const double* end, const Camera& camera, std::vector<double>& lifted) {
    const std::vector<double> along = arc_lengths(line, 2);
    lifted.insert(lifted.end(), start, start + 3);
    for (std::size_t i = 1; i + 1 < along.size(); ++i) {
        const double share = along[i] / along.back(), z = 1 / ((1 - share) / start[2] + share / end[2]);
        lifted.insert(lifted.end(), {(line[2 * i] - camera.cx) * z / camera.fx, (line[2 * i + 1] - camera.cy) * z / camera.fy, z});
    }
    lifted.insert(lifted.end(), end, end + 3);
}

struct Ends {
    const Matrix<double>&points, &tangents;
    const Vector<bool>& closed;
    std::vector<double> seen, ahead;  // px, place and direction out of the chain

    Ends(const Matrix<double>& points, const Matrix<double>& tangents, const Vector<bool>& closed, const Camera& camera, double radius)
        : points(points), tangents(tangents), closed(closed), seen(2 * points.shape(0)), ahead(seen.size()) {
        for (Index e = 0; e < Index(points.shape(0)); ++e) {
            double next[3];
            for (Index d = 0; d < 3; ++d) next[d] = points(e, d) + radius * tangents(e, d);
            camera.project(points.data() + 3 * e, &seen[2 * e]);
            camera.project(next, &ahead[2 * e]);
            for (Index d = 0; d < 2; ++d) ahead[2 * e + d] -= seen[2 * e + d];
        }
    }
    // Return the ends of open chains that are on a line, in the order of the places `at` the lines.
    std::vector<Index> along_lines(const std::vector<Index>& at) const {
        std::vector<Index> on;
        for (Index e = 0; e < Index(at.size()); ++e) {
            if (at[e] >= 0 && !closed(e / 2)) on.push_back(e);
        }
        std::stable_sort(on.begin(), on.end(), [&](Index a, Index b) { return at[a] < at[b]; });
        return on;
    }
};

void check(const Matrix<double>& points, const Matrix<double>& tangents, const Matrix<double>& joints, const Vector<Index>& bounds,
           const Vector<bool>& closed, const Matrix<double>& lines, const Vector<Index>& line_bounds) {
    require(points.shape(1) == 3 && tangents.shape(1) == 3 && joints.shape(1) == 3, "points, tangents or joints are not (., 3)");
    require(points.shape(0) == tangents.shape(0) && points.shape(0) == 2 * closed.shape(0), "ends are not two per chain");
    require(bounds.shape(0) == closed.shape(0) + 1, "closed is not one per chain");
    require(lines.shape(1) == 2, "lines are not (L, 2)");
    check_bounds(bounds, joints.shape(0));
    check_bounds(line_bounds, lines.shape(0));
    for (std::size_t k = 0; k < lines.size(); ++k) require(std::isfinite(lines.data()[k]), "a point of a line is not finite");
}

auto gaps_along_lines(Matrix<double> points, Matrix<double> tangents, Matrix<double> joints, Vector<Index> bounds, Vector<bool> closed,
                      Vector<double> intrinsics, double radius, Matrix<double> lines, Vector<Index> line_bounds, double reach) {
    check(points, tangents, joints, bounds, closed, lines, line_bounds);
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    const Camera camera(intrinsics);
    const Ends ends(points, tangents, closed, camera, radius);
    const std::vector<double> targets(lines.data(), lines.data() + lines.size());
    const std::vector<Index> at = nearest_within(ends.seen, targets, reach), on = ends.along_lines(at);
    std::vector<Index> pairs, sizes{0}, owner(lines.shape(0));
    for (std::size_t k = 0; k + 1 < line_bounds.shape(0); ++k) {
        std::fill(owner.begin() + line_bounds(k), owner.begin() + line_bounds(k + 1), Index(k));
    }
    std::vector<double> found;
    std::optional<Samples> samples;
    for (std::size_t k = 0; k + 1 < on.size(); ++k) {
        const Index a = on[k], b = on[k + 1];
        if (a / 2 == b / 2 || owner[at[a]] != owner[at[b]]) continue;
        const std::vector<double> line(targets.begin() + 2 * at[a], targets.begin() + 2 * (at[b] + 1));
        if (!faces(line, &ends.ahead[2 * a], &ends.ahead[2 * b], reach)) continue;
        if (!samples) samples.emplace(joints, bounds, camera, reach);
        const std::vector<Index> near = nearest_within(line, samples->points, reach);
        const bool is_own = std::all_of(near.begin(), near.end(), [&](Index s) {
            return s < 0 || samples->chain[s] == a / 2 || samples->chain[s] == b / 2;
        });
        if (!is_own) continue;
        pairs.insert(pairs.end(), {a, b});
        add_lifted(line, points.data() + 3 * a, points.data() + 3 * b, camera, found);
        sizes.push_back(Index(found.size()) / 3);
    }
    return std::make_tuple(rows_of(std::move(pairs), 2), rows_of(std::move(found), 3), std::move(sizes));
}

}  // namespace

void bind_seen_gaps(Module& m) {
    // Find the gaps between ends of chains along lines in the image.
    //
    // Two ends of different open chains that follow each other on one line are a gap if they are at least `reach` apart along it, if
    // both point along it towards each other over that length, and if no other chain is within `reach` of the line between them.
    //
    // Parameters
    // ----------
    // points, tangents
    //     (2 C, 3) float64 m in the camera's optical frame, the ends of C chains, and unit vectors out of the chains
    // joints, bounds, closed
    //     (N, 3) float64 m, the joints of the chains one after the other; (C + 1,) int64, the first of each, and N; (C,) bool, rings
    // camera
    //     (4,) float64, the intrinsics fx, fy, cx, cy in px
    // radius
    //     m, of the object
    // lines, line_bounds
    //     (L, 2) float64 px, (u, v), points of lines one after the other, and int64, the first of each, and L
    // reach
    //     px within which an end or a chain is on a line
    //
    // Returns
    // -------
    // pairs : (K, 2) int64, the two ends of each gap, in the order of the line
    // points : (P, 3) float64 m, from the first end along the line to the second; inverse depth is interpolated
    // bounds : (K + 1,) int64, the first point of each gap, and P
    m.def("gaps_along_lines", &gaps_along_lines, "points"_array, "tangents"_array, "joints"_array, "bounds"_array, "closed"_array,
          "camera"_array, "radius"_a, "lines"_array, "line_bounds"_array, "reach"_a);
}
