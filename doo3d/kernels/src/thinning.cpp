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

#include <algorithm>
#include <array>

namespace {

using Bits = std::uint32_t;

// What is known of the 26 neighbors among themselves.
struct Tables {
    std::array<Bits, NEIGHBORS> adjacent_26{}, adjacent_6_in_18{};
    std::array<std::uint8_t, NEIGHBORS> parity{};  // the axes along which the step to each neighbor is odd
    Bits in_18 = 0, faces = 0;
    std::array<int, 6> directions{};  // the neighbors beyond each face, in the order in which the directions take turns

    Tables() {
        for (int a = 0; a < NEIGHBORS; ++a) {
            const Offset p = offset_of(a);
            if (manhattan(p) <= 2) in_18 |= Bits(1) << a;
            if (manhattan(p) == 1) faces |= Bits(1) << a;
            parity[a] = std::uint8_t(4 * std::abs(p.x) + 2 * std::abs(p.y) + std::abs(p.z));
        }
        for (int a = 0; a < NEIGHBORS; ++a) {
            for (int b = 0; b < NEIGHBORS; ++b) {
                const Offset p = offset_of(a), q = offset_of(b);
                const Offset step{std::abs(p.x - q.x), std::abs(p.y - q.y), std::abs(p.z - q.z)};
                if (std::max({step.x, step.y, step.z}) == 1) adjacent_26[a] |= Bits(1) << b;
                const bool both_in_18 = (in_18 >> a & 1) && (in_18 >> b & 1);
                if (both_in_18 && manhattan(step) == 1) adjacent_6_in_18[a] |= Bits(1) << b;
            }
        }
        constexpr Offset order[6] = {{0, 0, -1}, {0, 0, 1}, {0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0}};
        for (int d = 0; d < 6; ++d) {
            for (int n = 0; n < NEIGHBORS; ++n) {
                const Offset p = offset_of(n);
                if (p.x == order[d].x && p.y == order[d].y && p.z == order[d].z) directions[d] = n;
            }
        }
    }

    static int manhattan(const Offset& p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }
};

const Tables TABLES;

int lowest_bit(Bits bits) {
    int n = 0;
    while (!(bits & 1)) {
        bits >>= 1;
        ++n;
    }
    return n;
}

// Tell whether the cells hold exactly one connected piece that holds a bit of `seeds`.
bool is_one_piece(Bits cells, const std::array<Bits, NEIGHBORS>& adjacent, Bits seeds) {
    const Bits rest = cells & seeds;
    if (!rest) return false;
    Bits piece = rest & (~rest + 1), frontier = piece;
    while (frontier) {
        Bits reach = 0;
        for (Bits left = frontier; left; left &= left - 1) reach |= adjacent[lowest_bit(left)];
        frontier = reach & cells & ~piece;
        piece |= frontier;
    }
    return !(rest & ~piece);
}

// Tell whether a voxel with these neighbors can be deleted without a change of the topology.
bool is_simple(Bits bits) {
    return is_one_piece(bits, TABLES.adjacent_26, bits) &&
           is_one_piece(~bits & TABLES.in_18, TABLES.adjacent_6_in_18, TABLES.faces);
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

    std::vector<std::uint8_t> alive;

private:
    // Label each voxel by the parities of its steps in x, y, z from its component's first.
    void label_subgrids() {
        std::vector<Index> stack;
        for (Index seed = 0; seed < table_.size(); ++seed) {
            if (subgrid_[seed] >= 0) continue;
            subgrid_[seed] = 0;
            stack.assign(1, seed);
            while (!stack.empty()) {
                const Index i = stack.back();
                stack.pop_back();
                for (int n = 0; n < NEIGHBORS; ++n) {
                    const Index j = table_.row(i)[n];
                    if (j >= 0 && subgrid_[j] < 0) {
                        subgrid_[j] = std::int8_t(subgrid_[i] ^ TABLES.parity[n]);
                        stack.push_back(j);
                    }
                }
            }
        }
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
                alive[i] = 0;
                changed = true;
                for (int n = 0; n < NEIGHBORS; ++n) {
                    const Index j = table_.row(i)[n];
                    if (j < 0) continue;
                    bits_[j] &= ~(Bits(1) << (25 - n));
                    stale_[j] = alive[j];
                }
            }
        }
        return changed;
    }

    const NeighborTable& table_;
    std::vector<Bits> bits_;
    std::vector<std::uint8_t> stale_;  // a neighbor was deleted since the voxel was last found not deletable
    std::vector<std::int8_t> subgrid_;
    std::vector<Index> chosen_;
};

// A neighbor at a fixed step has its key at a fixed difference, so one pass over the keys with two pointers links all voxels in
// that direction; the opposite direction comes with it.
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
    std::vector<std::int32_t> table(count * NEIGHBORS, -1);
    count_visits(count * NEIGHBORS);
    for (int n = 13; n < NEIGHBORS; ++n) {
        const Offset step = offset_of(n);
        const Index stride = (step.x * shape[1] + step.y) * shape[2] + step.z;
        for (Index i = 0, j = 0; i < count; ++i) {
            const Index wanted = keys[i] + stride;
            while (j < count && keys[j] < wanted) ++j;
            if (j < count && keys[j] == wanted) {
                table[i * NEIGHBORS + n] = std::int32_t(j);
                table[j * NEIGHBORS + 25 - n] = std::int32_t(i);
            }
        }
    }
    return to_numpy(std::move(table), count, NEIGHBORS);
}

auto thin_voxels(Matrix<std::int32_t> table) {
    const NeighborTable neighbors(table);
    Thinning thinning(neighbors);
    while (thinning.pass()) {
    }
    return to_numpy_bool(thinning.alive);
}

}  // namespace

void bind_thinning(nb::module_& m) {
    m.def("neighbor_table", &neighbor_table, "coords"_a.noconvert());
    m.def("is_simple", &is_simple, "bits"_a);
    m.def("thin_voxels", &thin_voxels, "table"_a.noconvert());
}
