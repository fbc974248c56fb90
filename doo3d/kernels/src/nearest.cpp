// Nearest targets of many points that lie near them, and sums over the points of each target.
#include "arrays.h"

#include <algorithm>

namespace {

// Cells per `reach` along each axis, in which the points are sorted.
constexpr double CELLS_PER_REACH = 3.0;

// The points sorted into square cells along the two axes in which they extend farthest: coordinates cell by cell, with the least
// squared distance so far and whose it is. The edge of the cells is doubled until their number is in proportion to the points.
class Cells {
public:
    Cells(const double* points, Index count, Index dim, double edge)
        : Cells(points, count, dim, edge, [](const double*) { return true; }) {}

    // The same cells, without the points of which `is_wanted` is false.
    template <class IsWanted>
    Cells(const double* points, Index count, Index dim, double edge, IsWanted is_wanted) : dim_(dim) {
        double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, extent[3] = {0, 0, 0};
        if (dim == 2) {
            bound<2>(points, count, low, high);
        } else {
            bound<3>(points, count, low, high);
        }
        for (Index d = 0; d < dim; ++d) extent[d] = high[d] - low[d];
        const Index shortest = dim == 2 ? 2 : Index(std::min_element(extent, extent + 3) - extent);
        for (Index d = 0, k = 0; d < dim; ++d) {
            if (d != shortest) axis_[k++] = d;
        }
        const double rows = extent[axis_[0]], columns = extent[axis_[1]];
        while ((std::floor(rows / edge) + 1) * (std::floor(columns / edge) + 1) > double(count) + 4096.0) edge *= 2;
        per_unit_ = 1 / edge;
        for (Index k = 0; k < 2; ++k) {
            low_[k] = low[axis_[k]];
            shape_[k] = Index(extent[axis_[k]] * per_unit_) + 1;
        }
        start_.assign(shape_[0] * shape_[1] + 2, 0);
        std::vector<std::int32_t> cell(count, -1);
        for (Index n = 0; n < count; ++n) {
            const double* p = points + n * dim;
            if (!finite(p) || !is_wanted(p)) continue;
            cell[n] = std::int32_t(Index((p[axis_[0]] - low_[0]) * per_unit_) * shape_[1] + Index((p[axis_[1]] - low_[1]) * per_unit_));
            ++start_[cell[n] + 2];
        }
        for (std::size_t c = 2; c < start_.size(); ++c) start_[c] += start_[c - 1];
        size = start_.back();
        order.resize(size);
        position_.resize(size * dim);
        for (Index n = 0; n < count; ++n) {
            if (cell[n] < 0) continue;
            const Index k = start_[cell[n] + 1]++;
            order[k] = std::int32_t(n);
            for (Index d = 0; d < dim; ++d) position_[d * size + k] = points[n * dim + d];
        }
        square.assign(size, INFINITY);
        owner.assign(size, 0);
    }

    // Let target `number` compete for the points in the cells within `reach` of it; of equally near ones the first wins.
    void offer(const double* target, Index number, double reach) {
        for_each_run(target, reach, [&](Index begin, Index end) {
            if (dim_ == 2) {
                offer_run<2>(begin, end, target, number);
            } else {
                offer_run<3>(begin, end, target, number);
            }
        });
    }

    // Call `visit` with each sorted point in the cells within `reach` of a position.
    template <class Visit>
    void for_each_around(const double* at, double reach, Visit visit) const {
        for_each_run(at, reach, [&](Index begin, Index end) {
            for (Index k = begin; k < end; ++k) visit(k);
        });
    }

    // Write the offset from a position in space to a sorted point.
    void offset(Index k, const double* from, double* result) const {
        for (Index d = 0; d < 3; ++d) result[d] = position_[d * size + k] - from[d];
    }

    Index size = 0;                    // number of sorted points; those that are not finite are left out
    std::vector<std::int32_t> order;   // the index of each
    std::vector<double> square;        // least squared distance from a target so far
    std::vector<Index> owner;          // whose it is

private:
    bool finite(const double* p) const { return (p[0] - p[0]) + (p[1] - p[1]) + (dim_ == 3 ? p[2] - p[2] : 0.0) == 0.0; }

    // Find the lowest and the highest coordinates of finite points; of none both stay.
    template <int D>
    void bound(const double* points, Index count, double* low, double* high) const {
        double least[D], most[D];
        std::fill(least, least + D, INFINITY);
        std::fill(most, most + D, -INFINITY);
        for (const double* p = points; p != points + count * D; p += D) {
            if (!finite(p)) continue;
            for (int d = 0; d < D; ++d) {
                least[d] = p[d] < least[d] ? p[d] : least[d];
                most[d] = p[d] > most[d] ? p[d] : most[d];
            }
        }
        if (!(least[0] <= most[0])) return;
        std::copy(least, least + D, low);
        std::copy(most, most + D, high);
    }

    // Call `visit` with the first and one more than the last point of each row of cells within `reach` of a position.
    template <class Visit>
    void for_each_run(const double* position, double reach, Visit visit) const {
        Index first[2], last[2];
        for (Index k = 0; k < 2; ++k) {
            const double cells = double(shape_[k]), at = position[axis_[k]] - low_[k];
            first[k] = Index(std::min(std::max(std::floor((at - reach) * per_unit_), 0.0), cells));
            last[k] = Index(std::min(std::max(std::floor((at + reach) * per_unit_) + 1, 0.0), cells));
        }
        if (last[1] <= first[1]) return;
        for (Index row = first[0]; row < last[0]; ++row) {
            visit(start_[row * shape_[1] + first[1]], start_[row * shape_[1] + last[1]]);
        }
    }

    template <int D>
    void offer_run(Index begin, Index end, const double* target, Index number) {
        const double *x = position_.data(), *y = x + size, *z = y + size;
        double* best = square.data();
        Index* whose = owner.data();
        for (Index k = begin; k < end; ++k) {
            const double dx = x[k] - target[0], dy = y[k] - target[1];
            double between = dx * dx + dy * dy;
            if constexpr (D == 3) {
                const double dz = z[k] - target[2];
                between += dz * dz;
            }
            const bool nearer = between < best[k];  // without a branch, so that compilers can vectorize
            best[k] = nearer ? between : best[k];
            whose[k] = nearer ? number : whose[k];
        }
    }

    Index dim_;
    double per_unit_ = 1.0;
    Index axis_[2] = {0, 1};
    double low_[2] = {0, 0};
    Index shape_[2] = {1, 1};
    std::vector<Index> start_;       // of each cell, the first of its points
    std::vector<double> position_;  // axis by axis
};

// Each target competes for the points in the cells around it, one after the other: there are far fewer targets than points, and
// the points of a cell lie one behind the other in memory. A point without a target within reach is compared with all targets,
// unless the search is limited.
auto nearest(Matrix<double> points, Matrix<double> targets, double reach, bool limited) {
    const Index count = points.shape(0), size = targets.shape(0), dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(targets.shape(1)) == dim, "points and targets have different numbers of coordinates");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (Index k = 0; k < size * dim; ++k) require(std::isfinite(targets.data()[k]), "a target is not finite");
    std::vector<double> distance(count, INFINITY);
    std::vector<Index> index(count);
    if (size > 0 && count > 0) {
        Cells cells(points.data(), count, dim, reach / CELLS_PER_REACH);
        for (Index s = 0; s < size && cells.size > 0; ++s) cells.offer(targets.data() + s * dim, s, reach);
        for (Index k = 0; k < cells.size; ++k) {
            const Index n = cells.order[k];
            double best = cells.square[k];
            Index owner = cells.owner[k];
            if (!(best <= reach * reach)) {
                if (limited) continue;
                best = INFINITY;
                for (Index s = 0; s < size; ++s) {
                    const double between = squared_distance(points.data() + n * dim, targets.data() + s * dim, dim);
                    if (between < best) {
                        best = between;
                        owner = s;
                    }
                }
            }
            distance[n] = std::sqrt(best);
            index[n] = owner;
        }
    }
    return std::make_tuple(to_numpy(std::move(distance)), to_numpy(std::move(index)));
}

void check_neighborhoods(const Matrix<double>& points, const Matrix<double>& centers, double reach) {
    require(points.shape(1) == 3 && centers.shape(1) == 3, "points and centers are not (., 3)");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (std::size_t k = 0; k < centers.size(); ++k) require(std::isfinite(centers.data()[k]), "a center is not finite");
}

// Call `visit` with the offset from a center to each point within reach of it.
template <class Visit>
void for_each_offset(const Cells& cells, const double* center, double reach, Visit visit) {
    cells.for_each_around(center, reach, [&](Index k) {
        double offset[3];
        cells.offset(k, center, offset);
        if (offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2] <= reach * reach) visit(offset);
    });
}

auto neighborhood_spreads(Matrix<double> points, Matrix<double> centers, double reach) {
    check_neighborhoods(points, centers, reach);
    const Index size = centers.shape(0);
    std::vector<Index> counts(size);
    std::vector<double> means(3 * size), covariances(9 * size);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (Index k = 0; k < 3 * size; ++k) {
        low[k % 3] = std::min(low[k % 3], centers.data()[k] - 1.01 * reach);
        high[k % 3] = std::max(high[k % 3], centers.data()[k] + 1.01 * reach);
    }
    const Cells cells(points.data(), points.shape(0), 3, reach / CELLS_PER_REACH, [&](const double* p) {
        return p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1] && p[2] >= low[2] && p[2] <= high[2];
    });
    for (Index s = 0; s < size; ++s) {
        double *mean = means.data() + 3 * s, *covariance = covariances.data() + 9 * s;
        Index count = 0;
        double sum[3] = {0, 0, 0}, square[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0};  // in registers
        for_each_offset(cells, centers.data() + 3 * s, reach, [&](const double* offset) {
            ++count;
            for (Index i = 0; i < 3; ++i) {
                sum[i] += offset[i];
                for (Index j = i; j < 3; ++j) square[3 * i + j] += offset[i] * offset[j];
            }
        });
        counts[s] = count;
        std::copy(sum, sum + 3, mean);
        std::copy(square, square + 9, covariance);
        const double number = double(std::max<Index>(counts[s], 1));
        for (Index i = 0; i < 3; ++i) mean[i] /= number;
        for (Index i = 0; i < 3; ++i) {
            for (Index j = i; j < 3; ++j) {
                covariance[3 * i + j] = covariance[3 * i + j] / number - mean[i] * mean[j];
                covariance[3 * j + i] = covariance[3 * i + j];
            }
        }
    }
    return std::make_tuple(to_numpy(std::move(counts)), to_numpy(std::move(means), size, 3), to_numpy(std::move(covariances), size, 9));
}

// The cells that are occupied are kept in a hash table with open addressing, until it is decided whether they are more than wanted.
auto fill_cells(Matrix<double> points, Matrix<double> centers, double reach, Vector<Index> counts, Matrix<double> origins,
                Matrix<double> axes, double edge, double wanted) {
    check_neighborhoods(points, centers, reach);
    const Index size = centers.shape(0);
    require(Index(counts.shape(0)) == size, "counts are not (S,)");
    for (Index s = 0; s < size; ++s) require(counts(s) <= Index(points.shape(0)), "a count is larger than the number of points");
    require(wanted >= 0, "cells are negative");
    require(Index(origins.shape(0)) == size && origins.shape(1) == 3, "origins are not (S, 3)");
    require(Index(axes.shape(0)) == size && axes.shape(1) == 6, "axes are not (S, 6)");
    require(edge > 0 && reach / edge < 1e9, "edge is not positive, or too small for the reach");
    for (std::size_t k = 0; k < origins.size(); ++k) require(std::fabs(origins.data()[k]) <= 10 * reach, "an origin is far away");
    for (std::size_t k = 0; k < axes.size(); ++k) require(std::fabs(axes.data()[k]) <= 1.001, "an axis is not a unit vector");
    std::vector<Index> table;
    std::vector<Byte> is_filled(size);
    constexpr Index EMPTY = INT64_MIN;
    const Cells cells(points.data(), points.shape(0), 3, reach / CELLS_PER_REACH);
    for (Index s = 0; s < size; ++s) {
        const double *origin = origins.data() + 3 * s, *axis = axes.data() + 6 * s;
        double occupied = 0.0, left = double(counts(s));
        if (!(left > wanted)) continue;
        std::size_t slots = 16;
        int shift = 60;
        for (; double(slots) < 2 * left; --shift) slots *= 2;
        table.assign(slots, EMPTY);
        for_each_offset(cells, centers.data() + 3 * s, reach, [&](const double* offset) {
            if (occupied > wanted || !(occupied + left > wanted)) return;
            Index key = 0;
            for (Index k = 0; k < 2; ++k) {
                double along = 0.0;
                for (Index d = 0; d < 3; ++d) along += (offset[d] - origin[d]) * axis[3 * k + d];
                const Index cell = Index(along / edge);
                key = key * (Index(1) << 31) + (cell - (along / edge < double(cell))) % (Index(1) << 30);
            }
            std::size_t slot = (std::uint64_t(key) * 0x9E3779B97F4A7C15u) >> shift;
            while (table[slot] != EMPTY && table[slot] != key) slot = (slot + 1) & (slots - 1);
            occupied += table[slot] == EMPTY;
            left -= 1;
            table[slot] = key;
        });
        is_filled[s] = occupied > wanted;
    }
    return to_numpy_bool(is_filled);
}

auto lateral_sums(Matrix<double> points, Vector<double> distance, Vector<Index> index, Matrix<double> samples, Matrix<double> normals,
                  Vector<double> reach) {
    const Index count = points.shape(0), size = samples.shape(0);
    require(points.shape(1) == 2 && samples.shape(1) == 2 && normals.shape(1) == 2, "points, samples and normals are not (., 2)");
    require(Index(distance.shape(0)) == count && Index(index.shape(0)) == count, "distance and index are not one per point");
    require(Index(normals.shape(0)) == size && Index(reach.shape(0)) == size, "normals and reach are not one per sample");
    std::vector<double> counts(size), totals(size);
    for (Index n = 0; n < count; ++n) {
        const Index s = index(n);
        require(s >= 0 && s < std::max<Index>(size, 1), "an index lies outside the samples");
        if (size > 0 && distance(n) < reach(s)) {
            counts[s] += 1;
            totals[s] += (points(n, 0) - samples(s, 0)) * normals(s, 0) + (points(n, 1) - samples(s, 1)) * normals(s, 1);
        }
    }
    return std::make_tuple(to_numpy(std::move(counts)), to_numpy(std::move(totals)));
}

auto points_near_line(Matrix<double> points, Vector<double> origin, Vector<double> direction, double half_edge, double max_offset) {
    const Index count = points.shape(0), dim = points.shape(1);
    require(Index(origin.shape(0)) == dim && Index(direction.shape(0)) == dim, "origin and direction are not (D,)");
    require(dim >= 1 && dim <= 3, "points are not (N, 1) to (N, 3)");
    double start[3] = {0, 0, 0}, heading[3] = {0, 0, 0};
    for (Index d = 0; d < dim; ++d) {
        start[d] = origin(d);
        heading[d] = direction(d);
    }
    std::vector<double> kept, along, offsets;
    for (Index n = 0; n < count; ++n) {
        const double* point = points.data() + n * dim;
        bool inside = std::fabs(point[0] - start[0]) < half_edge;
        if (!inside) continue;  // as most points are
        double ahead = 0.0, square = 0.0;
        for (Index d = 0; d < dim; ++d) {
            const double step = point[d] - start[d];
            inside = inside && std::fabs(step) < half_edge;
            ahead += step * heading[d];
        }
        if (!inside) continue;
        for (Index d = 0; d < dim; ++d) {
            const double lateral = point[d] - start[d] - ahead * heading[d];
            square += lateral * lateral;
        }
        if (square < max_offset * max_offset) {
            kept.insert(kept.end(), point, point + dim);
            along.push_back(ahead);
            offsets.push_back(std::sqrt(square));
        }
    }
    const Index size = along.size();
    return std::make_tuple(to_numpy(std::move(kept), size, dim), to_numpy(std::move(along)), to_numpy(std::move(offsets)));
}

}  // namespace

void bind_nearest(nb::module_& m) {
    m.def("nearest", &nearest, "points"_a.noconvert(), "targets"_a.noconvert(), "reach"_a, "limited"_a);
    m.def("lateral_sums", &lateral_sums, "points"_a.noconvert(), "distance"_a.noconvert(), "index"_a.noconvert(),
          "samples"_a.noconvert(), "normals"_a.noconvert(), "reach"_a.noconvert());
    m.def("neighborhood_spreads", &neighborhood_spreads, "points"_a.noconvert(), "centers"_a.noconvert(), "reach"_a);
    m.def("fill_cells", &fill_cells, "points"_a.noconvert(), "centers"_a.noconvert(), "reach"_a, "counts"_a.noconvert(),
          "origins"_a.noconvert(), "axes"_a.noconvert(), "edge"_a, "cells"_a);
    m.def("points_near_line", &points_near_line, "points"_a.noconvert(), "origin"_a.noconvert(), "direction"_a.noconvert(),
          "half_edge"_a, "max_offset"_a);
}
