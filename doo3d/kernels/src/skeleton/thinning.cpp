// Topological thinning of voxels to a curve skeleton, over the occupied voxels only (Lee, Kashyap, Chu, CVGIP 56, 1994).
//
// A voxel may be deleted when it is simple: its 26 neighbors hold exactly one 26-connected piece of the object, and its
// 18 neighbors exactly one 6-connected piece of the background that touches one of its faces (Bertrand and
// Malandain, Pattern Recognition Letters 15, 1994). Six directions take turns, and every deletion is checked
// again at its time, so the numbers of components, of loops and of cavities stay. The time grows with the number of voxels, not
// with the box they lie in.
//
// A neighborhood is a bit set: bit n is neighbor n.
#include "thinning.h"

// A neighbor at a fixed step has its key at a fixed difference, so one pass over the keys with two pointers links all voxels in
// that direction; the opposite direction comes with it.
std::vector<std::int32_t> link_neighbors(const std::vector<Index>& keys, Index rows, Index columns) {
    const Index count = Index(keys.size());
    std::vector<std::int32_t> table(count * NEIGHBORS, -1);
    count_visits(count * NEIGHBORS);
    for (int n = 13; n < NEIGHBORS; ++n) {
        const Offset step = offset_of(n);
        const Index stride = (step.x * rows + step.y) * columns + step.z;
        for (Index i = 0, j = 0; i < count; ++i) {
            const Index wanted = keys[i] + stride;
            while (j < count && keys[j] < wanted) ++j;
            if (j < count && keys[j] == wanted) {
                table[i * NEIGHBORS + n] = std::int32_t(j);
                table[j * NEIGHBORS + 25 - n] = std::int32_t(i);
            }
        }
    }
    return table;
}

namespace {

using Bits = std::uint32_t;

// What is known of the 26 neighbors.
struct Tables {
    std::array<Byte, NEIGHBORS> parity{};  // the axes along which the step to each neighbor is odd
    std::array<int, 6> directions{};  // the neighbors beyond each face, in the order in which the directions take turns

    Tables() {
        constexpr Offset order[6] = {{0, 0, -1}, {0, 0, 1}, {0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0}};
        for (int n = 0; n < NEIGHBORS; ++n) {
            const Offset p = offset_of(n);
            parity[n] = Byte(4 * std::abs(p.x) + 2 * std::abs(p.y) + std::abs(p.z));
            for (int d = 0; d < 6; ++d) {
                if (p.x == order[d].x && p.y == order[d].y && p.z == order[d].z) directions[d] = n;
            }
        }
    }
};

const Tables TABLES;

// A cube of 3 x 3 x 3 cells is a bit set, too: bit 9 x + 3 y + z, the voxel itself is bit 13. A shift by 1, 3 or 9 bits moves all
// cells by one along z, y or x at once; those that would leave the cube at a side are masked out before.
struct Cube {
    static Bits of_neighbors(Bits bits) { return (bits & 0x1FFF) | (bits >> 13 << 14); }
    static Bits along_z(Bits b) { return (b & 0x36DB6DB) << 1 | (b & 0x6DB6DB6) >> 1; }
    static Bits along_y(Bits b) { return (b & 0x0FC7E3F) << 3 | (b & 0x7E3F1F8) >> 3; }
    static Bits along_x(Bits b) { return (b & 0x003FFFF) << 9 | b >> 9; }

    // Return the cells with all that touch them by a face, or at all.
    static Bits with_6(Bits b) { return b | along_z(b) | along_y(b) | along_x(b); }
    static Bits with_26(Bits b) {
        b |= along_z(b);
        b |= along_y(b);
        return b | along_x(b);
    }
};

// Tell whether the cells hold exactly one connected piece that holds a bit of `seeds`.
template <Bits (*GROW)(Bits)>
bool is_one_piece(Bits cells, Bits seeds) {
    const Bits rest = cells & seeds;
    if (!rest) return false;
    Bits piece = rest & (~rest + 1);
    for (Bits before = 0; piece != before;) {
        before = piece;
        piece = GROW(piece) & cells;
    }
    return !(rest & ~piece);
}

// Tell whether a voxel with these neighbors can be deleted without a change of the topology.
bool is_simple(Bits bits) {
    const Bits in_18 = 0x2EBDEBA, faces = 0x0415410;  // of the cube of 27
    const Bits cube = Cube::of_neighbors(bits);
    return is_one_piece<Cube::with_26>(cube, cube) && is_one_piece<Cube::with_6>(~cube & in_18, faces);
}

// Tell whether a voxel with these neighbors is simple and no end of a curve, which has one neighbor or none.
bool is_deletable(Bits bits) { return (bits & (bits - 1)) != 0 && is_simple(bits); }

// One thinning. Deleting in index order would erode a strip from one end: each deletion would expose the next voxel. So voxels
// are deleted in 8 interleaved sub-grids, where no two neighbors are tested one right after the other.
class Thinning {
public:
    explicit Thinning(const NeighborTable& table)
        : alive(table.size(), 1), table_(table), bits_(table.size()), stale_(table.size(), 1), subgrid_(table.size(), -1) {
        for (Index i = 0; i < table.size(); ++i) {
            for (int n = 0; n < NEIGHBORS; ++n) {
                if (table.row(i)[n] >= 0) bits_[i] |= Bits(1) << n;
            }
        }
        label_subgrids();
        count_visits(2 * table.size());
    }

    // Go once through the six directions; tell whether a voxel was deleted.
    bool pass() {
        bool changed = false;
        for (const int face : TABLES.directions) {
            collect(face);
            count_visits(table_.size() + 8 * Index(chosen_.size()));
            if (remove()) changed = true;
        }
        return changed;
    }

    std::vector<Byte> alive;

private:
    // Label each voxel by the parities of its steps in x, y, z from its component's first.
    void label_subgrids() {
        const auto is_new = [&](Index voxel) { return subgrid_[voxel] < 0; };
        flood(table_, is_new, [&](Index voxel, Index from, int n) {
            subgrid_[voxel] = from < 0 ? 0 : std::int8_t(subgrid_[from] ^ TABLES.parity[n]);
        });
    }

    // Collect the deletable voxels whose neighbor beyond a face is missing. A voxel that was found not deletable is not
    // tested again until one of its neighbors is deleted, which saves most of the tests.
    void collect(int face) {
        chosen_.clear();
        for (Index i = 0; i < table_.size(); ++i) {
            if (!stale_[i] || (bits_[i] >> face & 1)) continue;
            if (is_deletable(bits_[i])) {
                chosen_.push_back(i);
            } else {
                stale_[i] = 0;
            }
        }
    }

    // Delete those of the chosen voxels that still may be, sub-grid by sub-grid; tell whether there was one.
    bool remove() {
        bool changed = false;
        for (int subgrid = 0; subgrid < 8; ++subgrid) {
            for (const Index i : chosen_) {
                if (subgrid_[i] != subgrid) continue;
                stale_[i] = 0;
                if (!is_deletable(bits_[i])) continue;
                remove(i);
                changed = true;
            }
        }
        return changed;
    }
    void remove(Index voxel) {
        alive[voxel] = 0;
        for (int n = 0; n < NEIGHBORS; ++n) {
            const Index j = table_.row(voxel)[n];
            if (j < 0) continue;
            bits_[j] &= ~(Bits(1) << (25 - n));
            stale_[j] = alive[j];
        }
    }

    const NeighborTable& table_;
    std::vector<Bits> bits_;
    std::vector<Byte> stale_;  // a neighbor was deleted since the voxel was last found not deletable
    std::vector<std::int8_t> subgrid_;
    std::vector<Index> chosen_;
};

auto neighbor_table(StridedMatrix<Index> coords) {
    const Index count = coords.shape(0);
    require(coords.shape(1) == 3, "coords are not (M, 3)");
    Index shape[3] = {1, 1, 1};
    for (Index i = 0; i < count; ++i) {
        for (int d = 0; d < 3; ++d) {
            require(coords(i, d) >= 0 && coords(i, d) < (Index(1) << 62), "coords are not between 0 and 2^62");
            shape[d] = std::max(shape[d], coords(i, d) + 2);
        }
    }
    require(double(shape[0]) * double(shape[1]) * double(shape[2]) < 9e18, "the box of the voxels has more cells than 64 bits count");
    require(count < (Index(1) << 31), "there are more voxels than 32 bits count");
    std::vector<Index> keys(count);
    for (Index i = 0; i < count; ++i) {
        keys[i] = (coords(i, 0) * shape[1] + coords(i, 1)) * shape[2] + coords(i, 2);
        require(i == 0 || keys[i - 1] < keys[i], "coords are not in lexicographic order");
    }
    auto table = link_neighbors(keys, shape[1], shape[2]);
    return rows_of(std::move(table), NEIGHBORS);
}

auto thin_voxels(Matrix<std::int32_t> table) {
    const NeighborTable neighbors(table);
    Thinning thinning(neighbors);
    while (thinning.pass()) {
    }
    return flags(std::move(thinning.alive));
}

}  // namespace

void bind_thinning(Module& m) {
    // Return the indices of the 26 neighbors of each voxel.
    //
    // coords : (M, 3) int64 >= 1, index of each of M voxels along the three axes, in lexicographic order. Returns (M, 26) int32:
    // for each voxel, the row in `coords` of its neighbor at each offset from (-1, -1, -1) to (1, 1, 1) in lexicographic order
    // without (0, 0, 0); -1 where there is no voxel.
    m.def("neighbor_table", &neighbor_table, "coords"_array);
    // Tell which voxels belong to the curve skeleton, lines one voxel wide (Lee-Kashyap-Chu thinning).
    //
    // table : (M, 26) int32 as `neighbor_table` returns it: indices of the neighbors of each of M voxels, -1 for none. Returns (M,)
    // bool, True on the skeleton. The numbers of components, loops and cavities stay.
    //
    // Each of six directions takes its turn: the voxels exposed in that direction are collected and then deleted in 8 interleaved
    // sub-grids, so that no two neighbors are tested one right after the other. Each is tested again just before it is deleted.
    // Deleting in index order would erode a strip from one end, since each deletion would expose the next voxel.
    m.def("thin_voxels", &thin_voxels, "table"_array);
}
