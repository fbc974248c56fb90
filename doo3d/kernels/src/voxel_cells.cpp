// Voxels of a sparse grid: the cells that points occupy, closed, without small components.
#include "closing.h"
#include "point_cells.h"
#include "thinning.h"

#include <algorithm>

namespace {

class VoxelCells {
public:
    VoxelCells(Matrix<double> points, double size, Index margin, double limit)
        : points_(points), dim_(Index(points.shape(1))), size_(size), cells_(sorted(margin, limit)) {}

    double total() const { return cells_.total; }
    auto keys() const { return view_of(cells_.keys); }
    auto shape() const { return view_of(cells_.shape); }
    auto origin() const { return view_of(origin_); }

    auto closed(Index iterations, Vector<Index> part) const {
        std::vector<Index> parts(part.shape(0));
        for (std::size_t n = 0; n < parts.size(); ++n) parts[n] = part(n);
        std::vector<Index> keys = [&] {
            nb::gil_scoped_release released;
            return parts.empty() ? close_cells(cells_.keys, cells_.shape, iterations) : closed_parts(iterations, parts);
        }();
        return to_numpy(std::move(keys));
    }

    auto voxels(Vector<Index> keys, Index min_voxels) const;

private:
    template <class T>
    static nb::ndarray<nb::numpy, const T, nb::ndim<1>> view_of(const std::vector<T>& values) {
        return {values.data(), {values.size()}};
    }

    PointCells sorted(Index margin, double limit) {
        const double* points = points_.data();
        nb::gil_scoped_release released;
        require(dim_ == 2 || dim_ == 3, "points are neither (N, 2) nor (N, 3)");
        origin_.resize(dim_);
        lowest_corner(points, Index(points_.shape(0)), dim_, origin_.data());
        for (double& low : origin_) low = (std::floor(low / size_) - double(margin)) * size_;
        return PointCells(points, Index(points_.shape(0)), dim_, origin_.data(), size_, margin, limit);
    }

    // Return the cells that are occupied after each part of the points was closed by itself.
    std::vector<Index> closed_parts(Index iterations, const std::vector<Index>& part) const {
        require(part.size() == cells_.cell.size(), "part is not (N,)");
        count_visits(2 * Index(part.size()));
        Index count = 0;
        for (const Index p : part) {
            require(p >= 0 && p < Index(part.size()), "a part is not from 0 to the number of points");
            count = std::max(count, p + 1);
        }
        std::vector<std::vector<Index>> held(count);
        std::vector<Index> all, last(cells_.keys.size(), -1);
        for (std::size_t n = 0; n < part.size(); ++n) {
            if (last[cells_.cell[n]] == part[n]) continue;  // as most points, which lie in a cell of one part
            last[cells_.cell[n]] = part[n];
            held[part[n]].push_back(cells_.keys[cells_.cell[n]]);
        }
        const auto make_unique = [](std::vector<Index>& keys) {
            std::sort(keys.begin(), keys.end());
            keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
        };
        for (std::vector<Index>& keys : held) {
            make_unique(keys);
            const std::vector<Index> closed = close_cells(keys, cells_.shape, iterations);
            all.insert(all.end(), closed.begin(), closed.end());
        }
        make_unique(all);
        return all;
    }

    Matrix<double> points_;
    Index dim_;
    double size_;
    std::vector<double> origin_;
    PointCells cells_;
};

// The voxels of some cells, by ascending key.
struct Voxels {
    std::vector<Index> coords, counts;
    std::vector<double> centroids;  // those of cells without points are their centers
    std::vector<std::int32_t> table;

    Voxels(const std::vector<Index>& keys, const PointCells& cells, const double* points, const double* origin, double size)
        : dim_(Index(cells.shape.size())) {
        const Index count = Index(keys.size());
        counts.resize(count);
        coords.resize(count * dim_);
        centroids.resize(count * dim_);
        std::vector<Index> padded(keys);  // in 2-D with a third axis of three cells
        for (Index i = 0; i < count; ++i) {
            for (Index d = dim_, key = keys[i]; d-- > 0; key /= cells.shape[d]) {
                coords[i * dim_ + d] = key % cells.shape[d];
                centroids[i * dim_ + d] = origin[d] + (double(coords[i * dim_ + d]) + 0.5) * size;
            }
            if (dim_ == 2) padded[i] = 3 * keys[i] + 1;
        }
        add_points(keys, cells, points);
        table = link_neighbors(padded, cells.shape[1], dim_ == 3 ? cells.shape[2] : 3);
    }

    // Give the voxels without points the mean centroid of their neighbors with points, added in the order of the neighbors.
    void fill() {
        for (Index i = 0; i < Index(counts.size()); ++i) {
            if (counts[i]) continue;
            double sum[3] = {0.0, 0.0, 0.0}, number = 0.0;
            for (int n = 0; n < NEIGHBORS; ++n) {
                const Index j = table[i * NEIGHBORS + n];
                if (j < 0 || !counts[j]) continue;
                number += 1;
                for (Index d = 0; d < dim_; ++d) sum[d] += centroids[j * dim_ + d];
            }
            for (Index d = 0; number > 0 && d < dim_; ++d) centroids[i * dim_ + d] = sum[d] / number;
        }
    }

    // Keep the components of at least so many voxels.
    void keep_large(Index min_voxels) {
        const Index count = Index(counts.size());
        const std::vector<Index> label = label_components(NeighborTable(table), std::vector<std::uint8_t>(count, 1));
        std::vector<Index> voxels(count);
        for (const Index component : label) ++voxels[component];
        std::vector<std::int32_t> row(count, -1);
        Index kept = 0;
        for (Index i = 0; i < count; ++i) {
            if (voxels[label[i]] >= min_voxels) row[i] = std::int32_t(kept++);
        }
        if (kept == count) return;
        for (Index i = 0; i < count; ++i) {
            if (row[i] < 0) continue;
            counts[row[i]] = counts[i];
            for (Index d = 0; d < dim_; ++d) {
                coords[row[i] * dim_ + d] = coords[i * dim_ + d];
                centroids[row[i] * dim_ + d] = centroids[i * dim_ + d];
            }
            for (int n = 0; n < NEIGHBORS; ++n) {
                const std::int32_t j = table[i * NEIGHBORS + n];
                table[row[i] * NEIGHBORS + n] = j < 0 ? -1 : row[j];
            }
        }
        counts.resize(kept);
        coords.resize(kept * dim_);
        centroids.resize(kept * dim_);
        table.resize(kept * NEIGHBORS);
    }

private:
    // Replace the centers of the cells that hold points by their means, added in the order of the points.
    void add_points(const std::vector<Index>& keys, const PointCells& cells, const double* points) {
        std::vector<double> sums(cells.keys.size() * dim_);
        std::vector<Index> number(cells.keys.size());
        count_visits(Index(cells.cell.size() + 2 * keys.size()));
        for (std::size_t n = 0; n < cells.cell.size(); ++n) {
            const std::int32_t c = cells.cell[n];
            ++number[c];
            for (Index d = 0; d < dim_; ++d) sums[c * dim_ + d] += points[n * dim_ + d];
        }
        std::size_t i = 0;
        for (std::size_t c = 0; c < number.size(); ++c) {
            while (i < keys.size() && keys[i] < cells.keys[c]) ++i;
            require(i < keys.size() && keys[i] == cells.keys[c], "an occupied cell is not among the keys");
            counts[i] = number[c];
            for (Index d = 0; d < dim_; ++d) centroids[i * dim_ + d] = sums[c * dim_ + d] / double(number[c]);
        }
    }

    Index dim_;
};

auto VoxelCells::voxels(Vector<Index> keys, Index min_voxels) const {
    std::vector<Index> wanted(keys.shape(0));
    require(cells_.total * 3 < 9e18, "the box of the voxels has more cells than 64 bits count");
    require(wanted.size() < (std::size_t(1) << 31), "there are more voxels than 32 bits count");
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        wanted[i] = keys(i);
        require(wanted[i] >= 0 && double(wanted[i]) < cells_.total, "a key is not in the box");
        require(i == 0 || wanted[i - 1] < wanted[i], "keys are not ascending");
    }
    Voxels made = [&, points = points_.data()] {
        nb::gil_scoped_release released;
        Voxels all(wanted, cells_, points, origin_.data(), size_);
        all.fill();
        all.keep_large(min_voxels);
        return all;
    }();
    const std::size_t count = made.counts.size();
    return std::make_tuple(to_numpy(std::move(made.coords), count, dim_), to_numpy(std::move(made.centroids), count, dim_),
                           to_numpy(std::move(made.counts)), to_numpy(std::move(made.table), count, NEIGHBORS));
}

}  // namespace

void bind_voxel_cells(Module& m) {
    // The cells of a sparse grid that N points occupy, of which the voxels are made.
    //
    // The key of a cell is its row-major index in the box, which ends `margin` cells before the first and beyond the last point.
    //
    // Parameters
    // ----------
    // points
    //     (N, D) float64, D = 2 or 3, finite; they are not copied, and must not change
    // size
    //     edge of a cell, in the unit of the points
    // margin
    //     number of empty cells beside the points along each axis
    // limit
    //     number of cells of the box at most, 9e18 at most
    Class<VoxelCells>(m, "VoxelCells")
        .def(nb::init<Matrix<double>, double, Index, double>(), "points"_a.noconvert(), "size"_a, "margin"_a, "limit"_a)
        // Number of cells of the box; there are no `keys` if it is over the limit.
        .def_prop_ro("total", &VoxelCells::total)
        // Keys of the M occupied cells, (M,) int64, ascending.
        .def_prop_ro("keys", &VoxelCells::keys)
        // Number of cells of the box along each axis, (D,) int64.
        .def_prop_ro("shape", &VoxelCells::shape)
        // Lower corner of the box, (D,), in the unit of the points.
        .def_prop_ro("origin", &VoxelCells::origin)
        // Close holes: morphological closing with a cube of 2 iterations + 1 cells.
        //
        // Parameters
        // ----------
        // iterations
        //     dilations along each axis, followed by as many erosions, 0 to 1000 and less than the margin
        // part
        //     (N,) int64 >= 0, number of the part of each point; each part is closed by itself. Empty closes all at once
        //
        // Returns
        // -------
        // (K,) int64 ascending, keys of the occupied cells after closing, with those that hold points among them
        .def("closed", &VoxelCells::closed, "iterations"_a, "part"_a.noconvert())
        // Return the voxels with given keys, without small components.
        //
        // Parameters
        // ----------
        // keys
        //     (K,) int64 ascending, keys of the voxels, with those of all occupied cells among them
        // min_voxels
        //     26-connected components of fewer voxels are left out
        //
        // Returns
        // -------
        // coords : (V, D) int64, index of each voxel along each axis, in lexicographic order
        // centroids : (V, D) float64, mean of the points in each voxel, added in their order; of voxels without points the mean
        //     centroid of their neighbors that hold points, or the center where none does
        // counts : (V,) int64, number of points in each voxel
        // table : (V, 26) int32, as `neighbor_table` returns it; in 2-D for voxels whose third coordinates are equal
        .def("voxels", &VoxelCells::voxels, "keys"_a.noconvert(), "min_voxels"_a);
}
