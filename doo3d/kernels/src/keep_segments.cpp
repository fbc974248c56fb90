#include "arrays.h"

#include <algorithm>

namespace {

struct Chains {
    std::vector<double> points;
    std::vector<Index> bounds{0};
    std::vector<Byte> closed;
};

// Tell which segments stay: of two that overlap, that of the longer chain, of chains of equal length that of the earlier one.
std::vector<Byte> kept_segments(Vector<Index> bounds, Vector<bool> closed, Matrix<Index> pairs) {
    const Index chains = closed.shape(0), segments = bounds(chains) - chains;
    std::vector<Index> owner, size;
    for (Index c = 0; c < chains; ++c) {
        size.push_back(bounds(c + 1) - bounds(c) - 1);
        require(size[c] >= 0, "a chain has no joint");
        owner.insert(owner.end(), size[c], c);
    }
    const std::vector<Index> whole = size;
    std::vector<Byte> kept(segments, 1);
    count_visits(segments + Index(pairs.shape(0)));
    for (Index k = 0; k < Index(pairs.shape(0)); ++k) {
        const Index i = pairs(k, 0), j = pairs(k, 1);
        require(i >= 0 && i < segments && j >= 0 && j < segments, "a pair holds no segment");
        const Index a = owner[i], b = owner[j], first = bounds(a) - a;
        const bool is_joint = a == b && closed(a) && i == first && j == first + whole[a] - 1;  // of the first and the last of a ring
        if (is_joint || !kept[i] || !kept[j]) continue;
        const Index loser = size[b] <= size[a] ? j : i;
        kept[loser] = 0;
        --size[owner[loser]];
    }
    return kept;
}

// Return the runs of kept segments as chains; a ring that lost a segment is open.
Chains runs_of(const std::vector<Byte>& kept, Matrix<double> points, Vector<Index> bounds, Vector<bool> closed) {
    Chains runs;
    const Index dim = points.shape(1);
    for (Index c = 0; c < Index(closed.shape(0)); ++c) {
        const Byte *begin = kept.data() + bounds(c) - c, *end = kept.data() + bounds(c + 1) - c - 1;
        const bool is_ring = closed(c) && std::find(begin, end, Byte(0)) == end;
        for (const Byte* start = std::find(begin, end, Byte(1)); start < end;) {
            const Byte* stop = std::find(start, end, Byte(0));
            const double* joint = points.data() + (bounds(c) + (start - begin)) * dim;
            runs.points.insert(runs.points.end(), joint, joint + (stop - start + 1) * dim);
            runs.bounds.push_back(Index(runs.points.size()) / dim);
            runs.closed.push_back(is_ring);
            start = std::find(stop, end, Byte(1));
        }
    }
    return runs;
}

auto keep_segments(Matrix<double> points, Vector<Index> bounds, Vector<bool> closed, Matrix<Index> pairs) {
    const Index dim = points.shape(1), chains = closed.shape(0);
    require(dim > 0, "points have no coordinates");
    check_bounds(bounds, points.shape(0));
    require(Index(bounds.shape(0)) == chains + 1, "closed is not one per chain");
    require(pairs.shape(1) == 2, "pairs are not (K, 2)");
    const std::vector<Byte> kept = kept_segments(bounds, closed, pairs);
    Chains runs = runs_of(kept, points, bounds, closed);
    std::vector<double> removed;
    for (Index c = 0; c < chains; ++c) {
        for (Index p = bounds(c); p + 1 < bounds(c + 1); ++p) {
            const double* joint = points.data() + p * dim;
            if (!kept[p - c]) removed.insert(removed.end(), joint, joint + 2 * dim);
        }
    }
    const std::size_t joints = runs.points.size() / dim, lost = removed.size() / (2 * dim);
    return std::make_tuple(to_numpy(std::move(runs.points), joints, dim), to_numpy(std::move(runs.bounds)), to_numpy_bool(runs.closed),
                           to_numpy(std::move(removed), lost, 2, dim));
}

}  // namespace

void bind_keep_segments(Module& m) {
    // Remove one of each two overlapping segments, that of the chain with fewer segments left, and return the rest as chains.
    //
    // Of chains of equal length the later one loses its segment. The first and the last segment of a ring share a joint and stay.
    //
    // Parameters
    // ----------
    // points
    //     (J, D) float64, the joints of all C chains, one chain after the other
    // bounds
    //     (C + 1,) int64; chain c is points[bounds[c]:bounds[c + 1]], the last entry is J
    // closed
    //     (C,) bool, True for a ring
    // pairs
    //     (K, 2) int64, segments i < j that overlap, in the order in which one of them is removed; pairs that lost one are skipped
    //
    // Returns
    // -------
    // points, bounds, closed : the runs of segments that are left, as chains; a ring that lost a segment is open
    // removed : (S, 2, D) float64, the joints of the removed segments, in the order of the segments
    m.def("keep_segments", &keep_segments, "points"_a.noconvert(), "bounds"_a.noconvert(), "closed"_a.noconvert(), "pairs"_a.noconvert());
}
