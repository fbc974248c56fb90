#include "branch_graph.h"
#include "nearest.h"
#include "polyline.h"

namespace {

using Line = std::vector<double>;  // (P, D) points

// What is cut from the ends of a branch; lengths in the unit of the points.
struct Trim {
    double least, most;                // at an end; the first at a tip, too, where thinning leads into a corner
    double clearance;                  // distance from which on the surfaces of two strands do not touch
    double tip_share, junction_share;  // of the branch, at most
};

// Smooth a line by a moving mean. The window shrinks near the ends of an open line, which stay in place.
Line moving_mean(const Line& line, Index dim, Index half_width, bool closed) {
    const Index count = Index(line.size()) / dim, half = std::min(half_width, (count - 1) / 2), pad = closed ? half : 0;
    if (half < 1) return line;
    count_visits(count);
    const Index size = count + 2 * pad;
    Line total((size + 1) * dim), means(line.size());
    for (Index i = 0; i < size; ++i) {
        const double* point = line.data() + (i + count - pad) % count * dim;
        for (Index d = 0; d < dim; ++d) total[(i + 1) * dim + d] = total[i * dim + d] + point[d];
    }
    for (Index i = 0; i < count; ++i) {
        const Index at = i + pad, width = std::min(std::min(at, size - 1 - at), half);
        for (Index d = 0; d < dim; ++d) {
            means[i * dim + d] = (total[(at + width + 1) * dim + d] - total[(at - width) * dim + d]) / double(2 * width + 1);
        }
    }
    return means;
}

// Return, for each of L lines that leave one place, the index of its first point that is clear of all other lines; that of the last
// point looked through if none is. L >= 1, every line has points.
//
// A point is clear if it is farther than `clearance` from the first points of every other line, as many as are looked through of its own
// line, `counts`; `limits` are the numbers of points of each line that others are compared with at most.
std::vector<Index> first_clear(const std::vector<double>& points, Index dim, const std::vector<Index>& bounds,
                               const std::vector<Index>& counts, const std::vector<Index>& limits, double clearance) {
    const Index lines = Index(counts.size());
    std::vector<Index> line, number, first(lines);  // of the points that others are compared with
    std::vector<double> targets;
    for (Index e = 0; e < lines; ++e) {
        for (Index i = 0; i < std::min(limits[e], bounds[e + 1] - bounds[e]); ++i) {
            line.push_back(e);
            number.push_back(i);
            targets.insert(targets.end(), &points[(bounds[e] + i) * dim], &points[(bounds[e] + i) * dim] + dim);
        }
    }
    const Index size = Index(line.size());
    const NearestTarget tree(targets.data(), size, dim);
    Visits visits{size};
    for (Index e = 0; e < lines; ++e) {
        const Index own = std::min(counts[e], bounds[e + 1] - bounds[e]);
        const auto is_other = [&](Index k) { return line[k] != e && number[k] < counts[e]; };
        const auto is_clear = [&](Index i) {
            return tree.find(&points[(bounds[e] + i) * dim], {clearance * clearance, size}, is_other).index == size;
        };
        while (first[e] < own - 1 && !is_clear(first[e])) ++first[e];
        visits.count += first[e] + 1;
    }
    return first;
}

// A branch that becomes a path.
struct Kept {
    const Branch* branch;
    Line points;                        // with those of its nodes
    std::vector<double> along;          // their arc lengths
    std::array<double, 2> clear{};      // length at each end at a node until the branch is clear of all others there
};

class Paths {
public:
    Paths(BranchGraph&& graph, Index dim, Index window_half, const Trim& trim)
        : graph_(std::move(graph)), dim_(dim), window_half_(window_half), trim_(trim) {
        lengths = {graph_.spur_length, graph_.loop_length, 0.0};
    }

    void add_loops(double min_loop) {
        for (const Branch& branch : graph_.branches) {
            if (!branch.is_there || !graph_.is_loop(branch)) continue;
            graph_.loops.push_back(graph_.all_points(branch));
            graph_.loops.back().resize(graph_.loops.back().size() - dim_);
        }
        for (const Line& loop : graph_.loops) {
            const double last = std::sqrt(squared_distance(loop.data(), loop.data() + loop.size() - dim_, dim_));
            const double perimeter = arc_lengths(loop, dim_).back() + last;
            if (perimeter >= min_loop) {
                append(moving_mean(loop, dim_, window_half_, true), true);
            } else {
                lengths[1] += perimeter;
            }
        }
    }

    // Add the longest branches; return the number of all.
    Index add_branches(Index most_branches) {
        std::vector<const Branch*> all;
        count_visits(Index(graph_.branches.size()));
        for (const Branch& branch : graph_.branches) {
            if (branch.is_there && !graph_.is_loop(branch)) all.push_back(&branch);
        }
        const Index count = Index(all.size());
        if (count > most_branches) {
            std::stable_sort(all.begin(), all.end(), [](const Branch* a, const Branch* b) { return a->length > b->length; });
            all.resize(most_branches);
            std::sort(all.begin(), all.end());  // in the order in which they were added
        }
        for (const Branch* branch : all) {
            Line points = graph_.all_points(*branch);
            std::vector<double> along = arc_lengths(points, dim_);
            kept_.push_back({branch, std::move(points), std::move(along)});
        }
        find_clear_lengths();
        for (const Kept& kept : kept_) {
            const Line line = trimmed(kept);
            if (Index(line.size()) > dim_) append(moving_mean(line, dim_, window_half_, false), false);
        }
        return count;
    }

    Line points;
    std::vector<Index> bounds{0};
    std::vector<Byte> closed;
    std::vector<double> lengths;  // of the skeleton that is in no path: spurs, loops, trimmed ends

private:
    using End = std::pair<Kept*, int>;  // 0 for the first point, 1 for the last

    void append(const Line& line, bool is_closed) {
        points.insert(points.end(), line.begin(), line.end());
        bounds.push_back(Index(points.size()) / dim_);
        closed.push_back(is_closed);
    }

    void find_clear_lengths() {
        std::map<Index, std::vector<End>> at_node;
        for (Kept& kept : kept_) {
            if (kept.branch->a != FREE) at_node[kept.branch->a].push_back({&kept, 0});
            if (kept.branch->b != FREE) at_node[kept.branch->b].push_back({&kept, 1});
        }
        for (const auto& [node, leaving] : at_node) find_clear_lengths(leaving);
    }

    // Both ends of a branch at one node count as two branches, each up to the middle.
    void find_clear_lengths(const std::vector<End>& leaving) {
        std::vector<Index> counts, limits, starts{0};
        for (const auto& [kept, end] : leaving) {
            const Index size = Index(kept->along.size());
            Index count = 0;
            while (count < size && distance(*kept, end, count) < trim_.most) ++count;
            counts.push_back(count + 1);
        }
        const Index most = *std::max_element(counts.begin(), counts.end());
        Line near;
        for (const auto& [kept, end] : leaving) {
            const Index size = Index(kept->along.size()), count = std::min(size, most);
            for (Index i = 0; i < count; ++i) {
                const double* point = kept->points.data() + (end == 0 ? i : size - 1 - i) * dim_;
                near.insert(near.end(), point, point + dim_);
            }
            starts.push_back(starts.back() + count);
            limits.push_back(kept->branch->a == kept->branch->b ? size / 2 + 1 : most);
        }
        count_visits(starts.back());
        const std::vector<Index> first = first_clear(near, dim_, starts, counts, limits, trim_.clearance);
        for (std::size_t e = 0; e < leaving.size(); ++e) {
            leaving[e].first->clear[leaving[e].second] = distance(*leaving[e].first, leaving[e].second, first[e]);
        }
    }

    // The arc length from an end to the point of this number from there.
    static double distance(const Kept& kept, int end, Index number) {
        const Index last = Index(kept.along.size()) - 1;
        return end == 0 ? kept.along[number] : kept.along[last] - kept.along[last - number];
    }

    // Return the points of a branch without its ends; none where nothing is left.
    Line trimmed(const Kept& kept) {
        const double length = kept.along.back();
        std::array<double, 2> cut{};
        for (int end = 0; end < 2; ++end) {
            const bool is_tip = (end == 0 ? kept.branch->a : kept.branch->b) == FREE;
            cut[end] = is_tip ? std::min(trim_.least, trim_.tip_share * length)
                              : std::max(trim_.least, std::min(kept.clear[end], trim_.junction_share * length));
        }
        if (cut[0] + cut[1] >= length) {
            lengths[2] += length;
            return {};
        }
        lengths[2] += cut[0] + cut[1];
        const double low = cut[0], high = length - cut[1];
        const auto coordinate = [&](Index i, Index d) { return kept.points[i * dim_ + d]; };
        Line line(dim_);
        place_at(coordinate, kept.along, low, dim_, line.data());
        for (std::size_t i = 0; i < kept.along.size(); ++i) {
            if (!(kept.along[i] > low && kept.along[i] < high)) continue;
            line.insert(line.end(), kept.points.begin() + i * dim_, kept.points.begin() + (i + 1) * dim_);
        }
        line.resize(line.size() + dim_);
        place_at(coordinate, kept.along, high, dim_, line.data() + line.size() - dim_);
        return line;
    }

    BranchGraph graph_;
    const Index dim_, window_half_;
    const Trim trim_;
    std::vector<Kept> kept_;
};

auto skeleton_paths(Matrix<std::int32_t> table, Matrix<double> points, Index window_half, Vector<double> least, Vector<double> trim,
                    Vector<double> shares, Matrix<float> half_widths, Vector<double> origin, double corner_widths, Index most_branches) {
    const NeighborTable neighbors(table);
    const Index dim = points.shape(1);
    require(Index(points.shape(0)) == neighbors.size(), "table and points have different lengths");
    require(dim == 2 || dim == 3, "points are neither (K, 2) nor (K, 3)");
    require(least.shape(0) == 3 && trim.shape(0) == 3, "least or trim are not three lengths");
    require(shares.shape(0) == 2 && origin.shape(0) == 2, "shares or origin are not two numbers");
    require(trim(2) >= 0 && std::isfinite(trim(2)), "the clearance is not finite and 0 or more");
    require(half_widths.size() == 0 || dim == 2, "points in 3-D have no half-widths");
    require(window_half >= 0 && most_branches >= 0, "window_half or most_branches is negative");
    const Least kept{least(0), least(1), least(2), corner_widths};
    const Index height = half_widths.size() ? Index(half_widths.shape(0)) : 0, width = height ? Index(half_widths.shape(1)) : 0;
    const HalfWidths widths{half_widths.data(), height, width, origin(0), origin(1)};
    const Trim cut{trim(0), trim(1), trim(2), shares(0), shares(1)};
    Index count = 0;
    Paths paths = [&] {
        BranchGraph graph(traced_branches(neighbors), points.data(), dim);
        graph.simplify(kept, widths);
        Paths found(std::move(graph), dim, window_half, cut);
        found.add_loops(kept.loop);
        count = found.add_branches(most_branches);
        return found;
    }();
    return std::make_tuple(rows_of(std::move(paths.points), dim), std::move(paths.bounds), flags(std::move(paths.closed)),
                           std::move(paths.lengths), count);
}

}  // namespace

void bind_skeleton_paths(Module& m) {
    // Return smooth paths along the branches of a skeleton, without spurs and small loops, cut where strands touch.
    //
    // The branches are those of `trace_branches`; a node is in the middle of the voxels of a junction. Spurs and small loops are
    // removed, the shortest first; a node left with fewer than three branches becomes a point of one branch. Last, a short branch
    // between two forks is contracted: thinning makes such a pair of a crossing. A free end is cut by a length; so is an end at a
    // node, and on until it is clear of every other branch there.
    //
    // Parameters
    // ----------
    // table
    //     (K, 26) int32 as `neighbor_table` returns it
    // points
    //     (K, D) float64, D = 2 or 3, position of each voxel
    // window_half
    //     number of points on either side that are averaged with each point of a path; fewer near the ends of an open path
    // least
    //     (3,) float64 lengths: shorter branches with one free end are spurs; loops of less perimeter are small; shorter branches
    //     between two nodes are contracted
    // trim
    //     (3,) float64: length cut at least; length at most within which an end at a node becomes clear of the others; distance from
    //     which on it is
    // shares
    //     (2,) float64, share of the length of a branch that is cut at most at a free end, and at a node unless the least length is
    //     more
    // half_widths
    //     (H, W) float32, distance of each pixel to the edge of the object, in 2-D; (0, 0) if spurs into corners are kept
    // origin
    //     (2,) float64, position of the first pixel of `half_widths`
    // corner_widths
    //     half-widths of the region around a node that a spur must be long to stay
    // most_branches
    //     number of branches that become paths at most, the longest
    //
    // Returns
    // -------
    // points : (P, D) float64, the points of all L paths: first the loops without a junction, whose first point is not repeated
    // bounds : (L + 1,) int64, row of the first point of each path; the last entry is P
    // closed : (L,) bool, True for a loop
    // lengths : (3,) float64, lengths of the spurs and of the small loops removed, and length cut from the ends
    // count : number of branches, those too that are beyond `most_branches`
    m.def("skeleton_paths", &skeleton_paths, "table"_array, "points"_array, "window_half"_a, "least"_array, "trim"_array, "shares"_array,
          "half_widths"_array, "origin"_array, "corner_widths"_a, "most_branches"_a);
}
