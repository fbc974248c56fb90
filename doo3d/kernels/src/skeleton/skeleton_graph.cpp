// Skeletons as graphs: branches between junctions.
#include "thinning.h"

std::vector<Index> label_components(const NeighborTable& table, const std::vector<Byte>& wanted) {
    std::vector<Index> label(table.size(), -1);
    Index components = 0;
    count_visits(table.size());
    const auto is_new = [&](Index voxel) { return wanted[voxel] && label[voxel] < 0; };
    flood(table, is_new, [&](Index voxel, Index from, int) {
        components += from < 0;
        label[voxel] = components - 1;
    });
    return label;
}

namespace {

// The branches of a skeleton between its junctions.
//
// A voxel with more than two neighbors is a junction voxel; junction voxels that touch are one junction. Every other voxel has
// at most two neighbors, so it belongs to exactly one branch, and a branch is followed by stepping to the one neighbor that was
// not visited yet. The order of the starts makes that complete: first from every junction voxel into each of its neighbors,
// which gives all branches with a junction; then from the tips, which gives the branches with two free ends; what is left are
// closed loops. A branch that comes back to the junction it left ends beside a voxel of it, which the first step must not take
// for the end.
class Tracing : public TracedBranches {
public:
    explicit Tracing(const NeighborTable& table) : table_(table), degree_(table.size()), visited_(table.size()) {
        count_visits(4 * table.size());  // degrees, starts of three kinds
        std::vector<Byte> crowded(table.size());
        for (Index i = 0; i < table.size(); ++i) {
            for (int n = 0; n < NEIGHBORS; ++n) degree_[i] += table.row(i)[n] >= 0;
            crowded[i] = degree_[i] > 2;
        }
        junction = label_components(table, crowded);
        for (Index i = 0; i < table.size(); ++i) visited_[i] = junction[i] >= 0;
        trace_from_junctions();
        trace_between_tips();
        trace_loops();
    }

private:
    void trace_from_junctions() {
        for (Index s = 0; s < table_.size(); ++s) {
            if (junction[s] < 0) continue;
            for (int n = 0; n < NEIGHBORS; ++n) {
                const Index first = table_.row(s)[n];
                if (first < 0 || visited_[first]) continue;
                Index end = follow(first, s, junction[s]);
                if (end < 0 && degree_[order.back()] == 2) end = junction[s];  // it came back to the voxel that it left
                close(junction[s], end);
            }
        }
    }

    void trace_between_tips() {
        for (Index s = 0; s < table_.size(); ++s) {
            if (!visited_[s] && degree_[s] <= 1) close(FREE, follow(s, s, FREE));
        }
    }

    void trace_loops() {
        for (Index s = 0; s < table_.size(); ++s) {
            if (visited_[s]) continue;
            follow(s, s, FREE);
            close(LOOP, LOOP);
        }
    }

    // Append the voxels of a branch to `order`; return the junction at its end, FREE for none.
    Index follow(Index voxel, Index previous, Index leaving) {
        for (;;) {
            visited_[voxel] = 1;
            order.push_back(voxel);
            Index following = -1, end = FREE;
            for (int n = 0; n < NEIGHBORS; ++n) {
                const Index j = table_.row(voxel)[n];
                if (j < 0) continue;
                if (!visited_[j]) {
                    following = j;
                } else if (junction[j] >= 0 && j != previous && junction[j] != leaving) {
                    end = junction[j];
                }
            }
            if (following < 0 || end >= 0) return end;
            previous = voxel;
            voxel = following;
            leaving = FREE;
        }
    }

    void close(Index start, Index end) {
        nodes.insert(nodes.end(), {start, end});
        bounds.push_back(Index(order.size()));
    }

    const NeighborTable& table_;
    std::vector<Index> degree_;
    std::vector<Byte> visited_;
};

}  // namespace

TracedBranches traced_branches(const NeighborTable& table) { return Tracing(table); }

namespace {

auto connected_parts(Matrix<std::int32_t> table) {
    const NeighborTable neighbors(table);
    return label_components(neighbors, std::vector<Byte>(neighbors.size(), 1));
}

auto trace_branches(Matrix<std::int32_t> table) {
    const NeighborTable neighbors(table);
    TracedBranches branches = traced_branches(neighbors);
    return std::make_tuple(std::move(branches.junction), std::move(branches.order), std::move(branches.bounds),
                           rows_of(std::move(branches.nodes), 2));
}

}  // namespace

void bind_skeleton_graph(Module& m) {
    // Return the number of the connected part of each voxel, (M,) int64, from 0 on in the order of their first voxels.
    //
    // table : (M, 26) int32 as `neighbor_table` returns it.
    m.def("connected_parts", &connected_parts, "table"_array);
    // Trace the branches of a skeleton between its junctions.
    //
    // A voxel with more than two neighbors is a junction voxel; junction voxels that touch are one junction. Every other voxel
    // belongs to exactly one branch.
    //
    // Parameters
    // ----------
    // table
    //     (K, 26) int32 as `neighbor_table` returns it: indices of the neighbors of each of K voxels, -1 for none
    //
    // Returns
    // -------
    // junction : (K,) int64, number of the junction that each voxel belongs to, -1 for none
    // order : (V,) int64, the V voxels that are not junction voxels, in order along each of B branches, one branch after the other
    // bounds : (B + 1,) int64; branch b is order[bounds[b]:bounds[b + 1]], the last entry is V
    // nodes : (B, 2) int64, the junctions at the start and at the end of each branch; -1 for a free end, (-2, -2) for a closed loop
    m.def("trace_branches", &trace_branches, "table"_array);
}
