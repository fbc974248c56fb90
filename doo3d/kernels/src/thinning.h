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
    Index size() const { return size_; }
    const std::int32_t* row(Index voxel) const { return table_ + voxel * NEIGHBORS; }

private:
    const std::int32_t* table_;
    Index size_;
};
