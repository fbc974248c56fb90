// The 26 neighbors of a voxel, in lexicographic order of their steps; neighbor 25 - n is opposite to neighbor n.
#pragma once

#include "arrays.h"

constexpr int NEIGHBORS = 26;

struct Offset {
    int x, y, z;
};

inline Offset offset_of(int n) {
    const int cell = n < 13 ? n : n + 1;  // of the 27 cells, without the middle
    return {cell / 9 - 1, cell / 3 % 3 - 1, cell % 3 - 1};
}

// A neighbor table (M, 26), -1 for none, whose entries were checked.
class NeighborTable {
public:
    explicit NeighborTable(const Matrix<std::int32_t>& table) : table_(table.data()), size_(table.shape(0)) {
        require(table.shape(1) == NEIGHBORS, "table is not (M, 26)");
        count_visits(size_);
        for (Index k = 0; k < size_ * NEIGHBORS; ++k) {
            require(table_[k] >= -1 && table_[k] < size_, "an entry of the table is no voxel");
        }
    }
    explicit NeighborTable(const std::vector<std::int32_t>& linked) : table_(linked.data()), size_(Index(linked.size()) / NEIGHBORS) {}
    Index size() const { return size_; }
    const std::int32_t* row(Index voxel) const { return table_ + voxel * NEIGHBORS; }

private:
    const std::int32_t* table_;
    Index size_;
};

// Fill connected parts of the voxels from their first ones on (flood fill by a stack): `enter(voxel, from, n)` is called with each new voxel
// that is neighbor n of one before, from -1 with the first of a part; then it is new no longer.
template <class IsNew, class Enter>
void flood(const NeighborTable& table, IsNew is_new, Enter enter) {
    std::vector<Index> stack;
    const auto add = [&](Index voxel, Index from, int n) {
        if (voxel < 0 || !is_new(voxel)) return;
        enter(voxel, from, n);
        stack.push_back(voxel);
    };
    for (Index seed = 0; seed < table.size(); ++seed) {
        add(seed, -1, 0);
        while (!stack.empty()) {
            const Index voxel = stack.back();
            stack.pop_back();
            for (int n = 0; n < NEIGHBORS; ++n) add(table.row(voxel)[n], voxel, n);
        }
    }
}

// Return the neighbor table of voxels in a box, given by their ascending row-major indices; `rows` and `columns` are the numbers of its
// cells along the second and the third axis. The outermost cells of the box must be empty.
std::vector<std::int32_t> link_neighbors(const std::vector<Index>& keys, Index rows, Index columns);

// Label the 26-connected components of the wanted voxels: (K,) number, -1 elsewhere.
std::vector<Index> label_components(const NeighborTable& table, const std::vector<Byte>& wanted);

// Instead of a junction's number: a branch ends at a tip; a branch is a closed loop without a junction.
enum : Index { FREE = -1, LOOP = -2 };

// The branches of a skeleton between its junctions, as `trace_branches` of the module returns them.
struct TracedBranches {
    std::vector<Index> junction, order, bounds{0}, nodes;
};
TracedBranches traced_branches(const NeighborTable& table);
