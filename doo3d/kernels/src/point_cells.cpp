// Points in the cells of a sparse grid, and in columns; see point_cells.h.
#include "point_cells.h"

#include <algorithm>

namespace {

// A point and the key of its cell; keys of 32 bits, as almost all boxes have, make it half as large.
template <class Key>
struct Tagged {
    Key key;
    std::uint32_t index;
};

// Sort points by the keys of their cells, in a cell in the order given: radix sort by 11 bits at a time.
template <class Key>
void sort_by_key(std::vector<Tagged<Key>>& points, double total) {
    std::vector<Tagged<Key>> other(points.size());
    for (int shift = 0; shift < 63 && double(Index(1) << shift) < total; shift += 11) {
        std::uint32_t count[2049] = {0};
        for (const auto& point : points) ++count[(point.key >> shift & 2047) + 1];
        if (std::find(count, count + 2049, points.size()) != count + 2049) continue;  // all have the same digit
        for (int k = 0; k < 2048; ++k) count[k + 1] += count[k];
        for (const auto& point : points) other[count[point.key >> shift & 2047]++] = point;
        points.swap(other);
    }
}

// Return the lowest and the highest coordinate along each axis; refuse coordinates that are not finite. Four points are looked at at
// a time, as vector instructions do.
template <Index DIM>
void bounds_of(const double* points, Index count, double* low, double* high) {
    const Index LANES = 4 * DIM;
    double finite[LANES], least[LANES], most[LANES];
    for (Index k = 0; k < LANES; ++k) {
        finite[k] = 0.0;
        least[k] = most[k] = count ? points[k % DIM] : 0.0;
    }
    const auto look_at = [&](const double* value, Index number) {
        for (Index k = 0; k < number; ++k) {
            finite[k] += value[k] - value[k];
            least[k] = std::min(least[k], value[k]);
            most[k] = std::max(most[k], value[k]);
        }
    };
    const Index end = count / 4 * LANES;
    for (Index n = 0; n < end; n += LANES) look_at(points + n, LANES);
    look_at(points + end, count * DIM - end);
    for (Index k = 0; k < LANES; ++k) {
        require(finite[k] == 0.0, "a coordinate is not finite");
        low[k % DIM] = k < DIM ? least[k] : std::min(low[k % DIM], least[k]);
        high[k % DIM] = k < DIM ? most[k] : std::max(high[k % DIM], most[k]);
    }
}

void bounds(const double* points, Index count, Index dim, double* low, double* high) {
    require(dim >= 1 && dim <= 3, "points have not 1 to 3 coordinates");
    const auto measure = dim == 3 ? bounds_of<3> : dim == 2 ? bounds_of<2> : bounds_of<1>;
    measure(points, count, low, high);
}

}  // namespace

void lowest_corner(const double* points, Index count, Index dim, double* low) {
    std::vector<double> high(dim);
    bounds(points, count, dim, low, high.data());
}

PointCells::PointCells(const double* points, Index count, Index dim, const double* origin, double size, Index margin, double limit)
    : shape(dim, margin + 1) {
    require(count < (Index(1) << 31), "there are more points than 32 bits count");
    require(size > 0 && std::isfinite(size), "size is not positive and finite");
    require(margin >= 0 && margin < (Index(1) << 31) && limit <= 9e18, "margin or limit are out of range");
    std::vector<double> low(dim), high(dim);
    bounds(points, count, dim, low.data(), high.data());
    total = 1.0;
    for (Index d = 0; d < dim; ++d) {
        require(std::isfinite(origin[d]) && !(low[d] < origin[d] && count), "a point lies below the origin");
        const double side = count ? std::floor((high[d] - origin[d]) / size) + double(margin + 1) : double(margin + 1);
        total *= side;
        shape[d] = side < 9e18 ? Index(side) : 0;
    }
    is_too_wide = !(total <= limit);
    if (is_too_wide) return;
    if (total <= std::min(4.0 * double(count), double(INT32_MAX))) {
        number_by_table(points, count, dim, origin, size);
    } else if (total < 4294967296.0) {
        number<std::uint32_t>(points, count, dim, origin, size);
    } else {
        number<std::uint64_t>(points, count, dim, origin, size);
    }
}

// Where the box has few cells for the points, a table of all of them takes less time than sorting.
void PointCells::number_by_table(const double* points, Index count, Index dim, const double* origin, double size) {
    std::vector<std::int32_t> index(std::size_t(total), -1);
    cell.resize(count);
    count_visits(3 * count + Index(total));  // for the bounds, the keys, the cells, and the table
    for (Index n = 0; n < count; ++n) {
        cell[n] = std::int32_t(key_of(points + n * dim, dim, origin, size));
        index[cell[n]] = 0;
    }
    for (std::size_t key = 0; key < index.size(); ++key) {
        if (index[key] < 0) continue;
        index[key] = std::int32_t(keys.size());
        keys.push_back(Index(key));
    }
    for (std::int32_t& c : cell) c = index[c];
}

template <class Key>
void PointCells::number(const double* points, Index count, Index dim, const double* origin, double size) {
    std::vector<Tagged<Key>> tagged(count);
    count_visits(5 * count);  // for the bounds, the keys, the order and the cells
    for (Index n = 0; n < count; ++n) {
        tagged[n] = {Key(key_of(points + n * dim, dim, origin, size)), std::uint32_t(n)};
    }
    sort_by_key(tagged, total);
    cell.resize(count);
    Index occupied = count > 0;
    for (Index n = 1; n < count; ++n) occupied += tagged[n].key != tagged[n - 1].key;
    keys.reserve(occupied);
    for (const auto& [key, index] : tagged) {
        if (keys.empty() || keys.back() != Index(key)) keys.push_back(Index(key));
        cell[index] = std::int32_t(keys.size()) - 1;
    }
}

void PointCells::group(std::vector<std::int32_t>& start, std::vector<std::int32_t>& order) const {
    start.assign(keys.size() + 2, 0);
    order.resize(cell.size());
    for (const std::int32_t c : cell) ++start[c + 2];
    for (std::size_t c = 2; c < start.size(); ++c) start[c] += start[c - 1];
    for (std::size_t n = 0; n < cell.size(); ++n) order[start[cell[n] + 1]++] = std::int32_t(n);
    start.pop_back();
}

PointColumns::PointColumns(const double* points, Index count) : points_(points) {
    require(count > 0 && count < (Index(1) << 31), "there are no points, or more than 32 bits count");
    double low[3], high[3], extent[3];
    bounds(points, count, 3, low, high);
    for (Index d = 0; d < 3; ++d) extent[d] = high[d] - low[d];
    const Index shortest = std::min_element(extent, extent + 3) - extent;
    for (Index d = 0, k = 0; d < 3; ++d) {
        if (d != shortest) axis_[k++] = d;
    }
    const double rows = extent[axis_[0]], columns = extent[axis_[1]];
    edge_ = std::max(rows, columns) / double(count);
    if (!(edge_ > 0 && std::isfinite(edge_))) edge_ = 1.0;
    while ((std::floor(rows / edge_) + 1) * (std::floor(columns / edge_) + 1) > double(count) / 2 + 64 && std::isfinite(edge_)) edge_ *= 1.5;
    for (Index k = 0; k < 2; ++k) {
        low_[k] = low[axis_[k]];
        shape_[k] = std::isfinite(edge_) ? Index(extent[axis_[k]] / edge_) + 1 : 1;
    }
    if (!std::isfinite(edge_)) edge_ = 1.0;
    start_.assign(shape_[0] * shape_[1] + 2, 0);
    order_.resize(count);
    std::vector<std::int32_t> cell(count);
    for (Index n = 0; n < count; ++n) {
        cell[n] = std::int32_t(column_of(points[3 * n + axis_[0]], 0) * shape_[1] + column_of(points[3 * n + axis_[1]], 1));
        ++start_[cell[n] + 2];
    }
    for (std::size_t c = 2; c < start_.size(); ++c) start_[c] += start_[c - 1];
    for (Index n = 0; n < count; ++n) order_[start_[cell[n] + 1]++] = std::int32_t(n);
}

Index PointColumns::column_of(double value, Index k) const {
    return Index(std::min(std::max((value - low_[k]) / edge_, 0.0), double(shape_[k] - 1)));
}

PointColumns::Window PointColumns::around(const double* at, double reach) const {
    Window window;
    for (Index k = 0; k < 2; ++k) {
        window.first[k] = column_of(at[axis_[k]] - reach, k);
        window.last[k] = column_of(at[axis_[k]] + reach, k);
    }
    return window;
}

Index PointColumns::points_in(const Window& window) const {
    Index points = 0;
    for (Index row = window.first[0] * shape_[1]; row <= window.last[0] * shape_[1]; row += shape_[1]) {
        points += start_[row + window.last[1] + 1] - start_[row + window.first[1]];
    }
    return points;
}

void PointColumns::collect(const Window& window, const double* at, std::vector<Near>& found) const {
    found.clear();
    Visits visits;
    for (Index row = window.first[0] * shape_[1]; row <= window.last[0] * shape_[1]; row += shape_[1]) {
        visits.count += start_[row + window.last[1] + 1] - start_[row + window.first[1]];
        for (std::int32_t k = start_[row + window.first[1]]; k < start_[row + window.last[1] + 1]; ++k) {
            found.push_back({squared_distance(points_ + 3 * Index(order_[k]), at, 3), order_[k]});
        }
    }
}

void PointColumns::within(const double* at, double reach, std::vector<Near>& found) const {
    collect(around(at, reach), at, found);
    const auto is_far = [&](const Near& near) { return near.square > reach * reach; };
    found.erase(std::remove_if(found.begin(), found.end(), is_far), found.end());
}

// The k-th nearest among those of some columns around the position is no nearer than the true one: its distance bounds the columns in
// which all k lie.
void PointColumns::nearest(const double* at, Index k, std::vector<Near>& found) const {
    Window window = around(at, edge_);
    for (double reach = 2 * edge_; points_in(window) < std::min<Index>(2 * k, order_.size()); reach *= 2) window = around(at, reach);
    collect(window, at, found);
    std::nth_element(found.begin(), found.begin() + (k - 1), found.end());
    const double rounding = 1e-15 * (std::fabs(at[axis_[0]]) + std::fabs(at[axis_[1]]));
    collect(around(at, std::sqrt(found[k - 1].square) * (1 + 1e-12) + rounding), at, found);
    std::nth_element(found.begin(), found.begin() + (k - 1), found.end());
    found.resize(k);
    std::sort(found.begin(), found.end());
}

namespace {

// The values along an axis, counted in bins of equal width; only values of bins that hold a wanted rank are compared.
struct Bins {
    static const Index COUNT = 4096;
    double low = 0.0, scale = 0.0;
    std::vector<Index> before = std::vector<Index>(COUNT + 1);
    std::vector<Byte> is_wanted = std::vector<Byte>(COUNT);
    std::vector<std::vector<double>> values = std::vector<std::vector<double>>(COUNT);

    void span(double least, double most) {
        const bool is_wide = most - least > 0 && std::isfinite(most - least) && std::isfinite(double(COUNT) / (most - least));
        low = is_wide ? least : 0.0;  // else all are in the first
        scale = is_wide ? double(COUNT) / (most - least) : 0.0;
    }
    Index of(double value) const { return std::min<Index>(Index((value - low) * scale), COUNT - 1); }
    Index of_rank(Index rank) const { return std::upper_bound(before.begin(), before.end(), rank) - before.begin() - 1; }
    double at(Index rank) {
        std::vector<double>& held = values[of_rank(rank)];
        const auto place = held.begin() + (rank - before[of_rank(rank)]);
        std::nth_element(held.begin(), place, held.end());
        return *place;
    }
};

// The first and the last value along each axis are known from the bounds.
std::vector<double> ranked(const double* points, Index count, Index dim, const std::vector<Index>& ranks) {
    std::vector<double> low(dim), high(dim), result(ranks.size() * dim);
    bounds(points, count, dim, low.data(), high.data());
    const auto is_inner = [&](Index rank) { return rank > 0 && rank < count - 1; };
    const Index passes = std::any_of(ranks.begin(), ranks.end(), is_inner) ? count * dim : 0;
    std::vector<Bins> axis(dim);
    count_visits(count + 2 * passes);
    for (Index d = 0; d < dim; ++d) axis[d].span(low[d], high[d]);
    for (Index n = 0; n < passes; n += dim) {
        for (Index d = 0; d < dim; ++d) ++axis[d].before[axis[d].of(points[n + d]) + 1];
    }
    for (Bins& bins : axis) {
        for (Index b = 0; b < Bins::COUNT; ++b) bins.before[b + 1] += bins.before[b];
        for (const Index rank : ranks) {
            if (is_inner(rank)) bins.is_wanted[bins.of_rank(rank)] = 1;
        }
    }
    for (Index n = 0; n < passes; n += dim) {
        for (Index d = 0; d < dim; ++d) {
            const Index bin = axis[d].of(points[n + d]);
            if (axis[d].is_wanted[bin]) axis[d].values[bin].push_back(points[n + d]);
        }
    }
    for (std::size_t r = 0; r < ranks.size(); ++r) {
        for (Index d = 0; d < dim; ++d) result[r * dim + d] = is_inner(ranks[r]) ? axis[d].at(ranks[r]) : ranks[r] ? high[d] : low[d];
    }
    return result;
}

auto values_at_ranks(Matrix<double> points, Vector<Index> ranks) {
    const Index count = points.shape(0), dim = points.shape(1);
    std::vector<Index> wanted(ranks.shape(0));
    for (std::size_t r = 0; r < wanted.size(); ++r) {
        wanted[r] = ranks(r);
        require(wanted[r] >= 0 && wanted[r] < count, "a rank is not from 0 to the number of points");
    }
    std::vector<double> values = [&, data = points.data()] {
        nb::gil_scoped_release released;
        return ranked(data, count, dim, wanted);
    }();
    return to_numpy(std::move(values), wanted.size(), dim);
}

auto nearest_points(Matrix<double> points, Matrix<double> positions, Index k) {
    const Index count = points.shape(0), size = positions.shape(0);
    require(points.shape(1) == 3 && positions.shape(1) == 3, "points and positions are not (., 3)");
    require(k >= 1 && k <= count, "k is not from 1 to the number of points");
    for (Index s = 0; s < 3 * size; ++s) require(std::isfinite(positions.data()[s]), "a position is not finite");
    std::vector<double> distance(size * k);
    std::vector<Index> index(size * k);
    const double *data = points.data(), *at = positions.data();
    {
        nb::gil_scoped_release released;
        const PointColumns columns(data, count);
        std::vector<PointColumns::Near> found;
        for (Index s = 0; s < size; ++s) {
            columns.nearest(at + 3 * s, k, found);
            for (Index j = 0; j < k; ++j) {
                distance[s * k + j] = std::sqrt(found[j].square);
                index[s * k + j] = found[j].index;
            }
        }
    }
    return std::make_tuple(to_numpy(std::move(distance), size, k), to_numpy(std::move(index), size, k));
}

auto least_near(Matrix<double> points, Matrix<double> positions, double reach, Index most) {
    const Index count = points.shape(0), size = positions.shape(0);
    require(points.shape(1) == 3 && positions.shape(1) == 2, "points are not (N, 3), or positions not (P, 2)");
    require(reach > 0 && most >= 1, "reach or most is not positive");
    for (Index s = 0; s < 2 * size; ++s) require(std::isfinite(positions.data()[s]), "a position is not finite");
    std::vector<double> result(size, std::nan("")), flat(points.data(), points.data() + 3 * count);
    if (count == 0) return to_numpy(std::move(result));
    ReleasedGil released;
    for (Index i = 0; i < count; ++i) flat[3 * i + 2] = 0.0;
    const PointColumns columns(flat.data(), count);
    std::vector<PointColumns::Near> near;
    for (Index s = 0; s < size; ++s) {
        const double at[3] = {positions.data()[2 * s], positions.data()[2 * s + 1], 0.0};
        columns.within(at, reach, near);
        if (Index(near.size()) > most) {
            std::nth_element(near.begin(), near.begin() + most, near.end());
            near.resize(most);
        }
        for (const PointColumns::Near& each : near) {
            if (std::sqrt(each.square) < reach) result[s] = std::fmin(result[s], points.data()[3 * each.index + 2]);
        }
    }
    released.end();
    return to_numpy(std::move(result));
}

}  // namespace

void bind_point_cells(Module& m) {
    // Return the coordinates that have the given ranks in ascending order, along each axis by itself.
    //
    // points : (N, D) float64, finite. ranks : (R,) int64, 0 to N - 1. Returns (R, D) float64.
    m.def("values_at_ranks", &values_at_ranks, "points"_a.noconvert(), "ranks"_a.noconvert());
    // Return the least value of the points of a plane near each of a few positions.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64, two finite coordinates and the value of each point; NaN tells nothing
    // positions
    //     (P, 2) float64, in the unit of the coordinates
    // reach
    //     distance within which a point is near
    // most
    //     number of points that count, the nearest ones
    //
    // Returns
    // -------
    // (P,) float64; NaN where no point is near
    m.def("least_near", &least_near, "points"_a.noconvert(), "positions"_a.noconvert(), "reach"_a, "most"_a);
    // Find the `k` points that are nearest to each of a few positions.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64, finite
    // positions
    //     (S, 3) float64, finite, in the unit of the points
    // k
    //     1 to N
    //
    // Returns
    // -------
    // distance : (S, k) float64, ascending
    // index : (S, k) int64, index of each of these points; of equally near ones the first is first
    m.def("nearest_points", &nearest_points, "points"_a.noconvert(), "positions"_a.noconvert(), "k"_a);
}
