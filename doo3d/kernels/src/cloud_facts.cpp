#include "point_cells.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <numeric>

namespace {

// Return the sum of the middle two of sorted values over 2, as NumPy takes the median.
double median(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
}

std::int32_t root_of(std::vector<std::int32_t>& parent, std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

// Cells of some points (N, 3) of which the outer `layers` of the box are empty.
struct Grouped {
    std::vector<double> origin;
    PointCells cells;
    std::vector<std::int32_t> start, order;

    Grouped(const std::vector<double>& points, double edge, Index layers)
        : origin(lowest(points, double(layers) * edge)),
          cells(points.data(), Index(points.size()) / 3, 3, origin.data(), edge, layers) {
        if (!is_too_wide()) cells.group(start, order);
    }
    bool is_too_wide() const { return cells.is_too_wide; }

    static std::vector<double> lowest(const std::vector<double>& points, double below) {
        std::vector<double> low(3, points.empty() ? 0.0 : INFINITY);
        for (std::size_t k = 0; k < points.size(); ++k) low[k % 3] = std::min(low[k % 3], points[k]);
        for (double& value : low) value -= below;
        return low;
    }
};

// Points (K, 3): the array that Python gave, or one made here.
struct Points : nb::object {
    NB_OBJECT(Points, nb::object, "numpy.ndarray[dtype=float64, shape=(*, *), order='C']", nb::isinstance<nb::ndarray<>>)
};

class CloudFacts {
public:
    CloudFacts(Matrix<double> points, Index sample_points, Index sample_seeds, double strand_spacings, double min_strand_fraction,
               double min_large_fraction)
        : points_(points), count_(points.shape(0)), min_strand_(min_strand_fraction), min_large_(min_large_fraction) {
        require(points.shape(1) == 3, "points are not (N, 3)");
        require(sample_points >= 1 && sample_seeds >= 1, "sample_points or sample_seeds is less than 1");
        require(strand_spacings > 0 && std::isfinite(strand_spacings), "strand_spacings is not positive and finite");
        const double* data = points.data();
        nb::gil_scoped_release released;
        every_ = std::max<Index>(1, count_ / sample_points);
        for (Index n = 0; n < count_; n += every_) {
            for (Index d = 0; d < 3; ++d) {
                require(std::fabs(data[3 * n + d]) < 1e150, "a coordinate is not finite, or its square is not");
                sample_.push_back(data[3 * n + d]);
            }
        }
        size_ = Index(sample_.size()) / 3;
        if (size_ == 0) return;
        measure_spacing(sample_seeds);
        apart_ = strand_spacings * spacing * std::sqrt(double(count_) / double(size_));
    }

    auto without_outliers(double cell_spacings, double min_ratio) const;
    bool strands_nearer(double distance) const;
    auto strand_of(Matrix<double> points) const;

    // Found when they are first asked for.
    const std::vector<Index>& strands() const {
        nb::gil_scoped_release released;  // before the lock, which another thread may hold
        std::call_once(once_, [this] { find_strands(); });
        return strands_;
    }

    double spacing = 1e-3;

private:
    void measure_spacing(Index sample_seeds);
    void find_strands() const;
    std::vector<std::int32_t> parts() const;

    Matrix<double> points_;
    Index count_, every_ = 1, size_ = 0;
    std::vector<double> sample_;  // every so many of the points
    double apart_ = 0.0, min_strand_, min_large_;
    mutable std::once_flag once_;
    mutable std::vector<Index> strands_;
};

void CloudFacts::measure_spacing(Index sample_seeds) {
    const Index nearest = std::min<Index>(8, size_ - 1);
    if (nearest < 1) return;
    const PointColumns columns(sample_.data(), size_);
    std::vector<PointColumns::Near> found;
    std::vector<double> distance;
    for (Index n = 0; n < size_; n += std::max<Index>(1, size_ / sample_seeds)) {
        columns.nearest(sample_.data() + 3 * n, nearest + 1, found);
        distance.push_back(std::sqrt(found[nearest].square));
    }
    spacing = std::max(median(distance) * std::sqrt(std::acos(-1.0) / double(nearest)) * std::sqrt(double(size_) / double(count_)), 1e-6);
}

// Return the part of each sampled point, by the first of its points: parts are farther than `apart_` from each other. Points of one
// cell are nearer than that, since its diagonal is as long; so cells are joined, each pair by the first two of their points found near.
std::vector<std::int32_t> CloudFacts::parts() const {
    const Grouped grid(sample_, apart_ / std::sqrt(3.0) * (1 - 1e-9), 2);
    if (grid.is_too_wide()) return {};
    std::vector<std::int32_t> parent(grid.cells.keys.size());
    std::iota(parent.begin(), parent.end(), 0);
    const double limit = apart_ * apart_;
    Visits visits{size_};
    for_each_near_pair(grid.cells, 2, [&](Index i, Index j) {
        ++visits.count;
        const std::int32_t one = root_of(parent, std::int32_t(i)), other = root_of(parent, std::int32_t(j));
        for (std::int32_t a = grid.start[i]; one != other && a < grid.start[i + 1]; ++a) {
            for (std::int32_t b = grid.start[j]; b < grid.start[j + 1]; ++b) {
                if (squared_distance(&sample_[3 * Index(grid.order[a])], &sample_[3 * Index(grid.order[b])], 3) > limit) continue;
                parent[std::max(one, other)] = std::min(one, other);
                return;
            }
        }
    });
    std::vector<std::int32_t> part(size_);
    for (Index n = 0; n < size_; ++n) part[n] = root_of(parent, grid.cells.cell[n]);
    return part;
}

// Strands are the large parts, numbered in the order of their first points; there are none if many points are in small parts.
void CloudFacts::find_strands() const {
    if (size_ == 0) return;
    const std::vector<std::int32_t> part = parts();
    std::vector<Index> size(size_), number(size_, -1);
    for (const std::int32_t p : part) ++size[p];
    Index count = 0, large = 0;
    for (const std::int32_t p : part) {
        if (double(size[p]) < min_strand_ * double(size_)) continue;
        ++large;
        if (number[p] < 0) number[p] = count++;
    }
    if (count < 2 || double(large) < min_large_ * double(size_)) return;
    strands_.resize(size_);
    for (Index n = 0; n < size_; ++n) strands_[n] = number[part[n]];
}

// The sums of the three coordinates of some points, and their number.
using Sum = std::array<double, 4>;

// Return the sums in each cell and the 26 around it, added in the order of the steps to them: row by row of three cells, each row by
// a position of its own in the ascending keys. Which of the cells are occupied no processor foresees: for those that are not a row
// of 0 is added. `own` has three rows of 0 more than there are cells.
WITH_AVX2 std::vector<Sum> sums_around(const PointCells& cells, const std::vector<Sum>& own) {
    std::vector<Sum> sums(cells.keys.size());
    count_visits(27 * Index(sums.size()));
    std::vector<Index> keys(sums.size() + 3, INT64_MAX);
    std::copy(cells.keys.begin(), cells.keys.end(), keys.begin());
    std::size_t at[9] = {0};
    Index steps[9];
    for (Index row = 0; row < 9; ++row) steps[row] = ((row / 3 - 1) * cells.shape[1] + row % 3 - 1) * cells.shape[2] - 1;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        Sum sum = own[i];
        for (Index row = 0; row < 9; ++row) {
            const Index first = keys[i] + steps[row];
            std::size_t j = at[row];
            j += keys[j] < first;
            j += keys[j] < first;
            while (keys[j] < first) ++j;
            at[row] = j;
            for (std::size_t k = j; k < j + 3; ++k) {
                const Sum& other = own[keys[k] <= first + 2 && k != i ? k : sums.size()];
                for (std::size_t d = 0; d < 4; ++d) sum[d] += other[d];
            }
        }
        sums[i] = sum;
    }
    return sums;
}

// Of an even number of points the median is the mean of the middle two; all points of a cell have as many neighbors.
double median_neighbors(const std::vector<Sum>& sums, const std::vector<Sum>& own, Index count) {
    double most = 0.0;
    for (const Sum& sum : sums) most = std::max(most, sum[3]);
    std::vector<Index> having(std::size_t(most) + 1);  // points that have so many neighbors
    for (std::size_t c = 0; c < sums.size(); ++c) having[std::size_t(sums[c][3])] += Index(own[c][3]);
    double middle[2] = {0, 0};
    for (Index k = 0; k < 2; ++k) {
        Index neighbors = 0;
        for (Index before = 0; before + having[neighbors] <= (count - 1 + k) / 2; ++neighbors) before += having[neighbors];
        middle[k] = double(neighbors);
    }
    return (middle[0] + middle[1]) / 2;
}

auto CloudFacts::without_outliers(double cell_spacings, double min_ratio) const {
    require(cell_spacings > 0 && std::isfinite(cell_spacings), "cell_spacings is not positive and finite");
    const double* points = points_.data();
    std::vector<double> kept, means;
    bool all = true;
    {
        nb::gil_scoped_release released;
        const double edge = cell_spacings * spacing;
        double origin[3];
        lowest_corner(points, count_, 3, origin);
        for (double& value : origin) value = count_ ? value - edge : 0.0;
        const PointCells cells(points, count_, 3, origin, edge, 1);
        if (count_ && !cells.is_too_wide) {
            std::vector<Sum> own(cells.keys.size() + 3);
            for (Index n = 0; n < count_; ++n) {
                Sum& sum = own[cells.cell[n]];
                for (Index d = 0; d < 3; ++d) sum[d] += points[3 * n + d];
                sum[3] += 1;
            }
            std::vector<Sum> sums = sums_around(cells, own);
            const double least = min_ratio * median_neighbors(sums, own, count_);
            Index size = 0;
            for (std::size_t c = 0; c < sums.size(); ++c) {
                size += sums[c][3] >= least ? Index(own[c][3]) : 0;
                for (Index d = 0; d < 3; ++d) sums[c][d] /= sums[c][3];
            }
            own = {};
            all = size == count_;
            means.resize(3 * size);
            if (!all) kept.resize(3 * size);
            Index row = 0;
            for (Index n = 0; n < count_; ++n) {
                const Sum& mean = sums[cells.cell[n]];
                if (!(mean[3] >= least)) continue;
                std::copy(mean.begin(), mean.begin() + 3, means.begin() + 3 * row);
                if (!all) std::copy(points + 3 * n, points + 3 * n + 3, kept.begin() + 3 * row);
                ++row;
            }
        } else {
            means.assign(points, points + 3 * count_);
        }
    }
    const std::size_t size = means.size() / 3;
    const nb::object same = all ? nb::cast(points_) : nb::cast(to_numpy(std::move(kept), size, 3));
    return std::make_tuple(nb::borrow<Points>(same), to_numpy(std::move(means), size, 3));
}

bool CloudFacts::strands_nearer(double distance) const {
    const std::vector<Index>& strands = this->strands();
    if (strands.empty() || !(distance > apart_)) return false;
    require(std::isfinite(distance), "distance is not finite");
    nb::gil_scoped_release released;
    const Grouped grid(sample_, distance, 1);
    if (grid.is_too_wide()) return false;
    std::vector<Index> lowest(grid.cells.keys.size(), INT64_MAX), highest(grid.cells.keys.size(), -1);
    for (Index n = 0; n < size_; ++n) {
        if (strands[n] < 0) continue;
        lowest[grid.cells.cell[n]] = std::min(lowest[grid.cells.cell[n]], strands[n]);
        highest[grid.cells.cell[n]] = std::max(highest[grid.cells.cell[n]], strands[n]);
    }
    bool found = false;
    const auto compare = [&](Index i, Index j) {
        if (found || std::max(highest[i], highest[j]) <= std::min(lowest[i], lowest[j])) return;  // all of one strand
        for (std::int32_t a = grid.start[i]; a < grid.start[i + 1]; ++a) {
            for (std::int32_t b = grid.start[j]; b < grid.start[j + 1]; ++b) {
                const Index one = grid.order[a], other = grid.order[b];
                if (strands[one] == strands[other] || strands[one] < 0 || strands[other] < 0) continue;
                if (std::sqrt(squared_distance(&sample_[3 * one], &sample_[3 * other], 3)) < distance) found = true;
            }
            if (found) return;
        }
    };
    for (std::size_t c = 0; c < lowest.size(); ++c) compare(Index(c), Index(c));
    for_each_near_pair(grid.cells, 1, compare);
    return found;
}

// Finds the strand of the nearest of some points. All points in a small cell are looked up at once, at its center: the nearest of each
// is no farther from the center than the nearest of the center and the diagonal of the cell. Most are found in a grid, whose cells are
// as wide as that: where all of the 27 cells around are of one strand, and one is so near that the nearest lies in them.
class StrandLookup {
public:
    StrandLookup(const std::vector<double>& points, std::vector<Index> strand, double edge)
        : points_(points), strand_(std::move(strand)), edge_(edge), grid_(points, edge, 1), columns_(points.data(), points.size() / 3) {}

    // Write the strand of each of N points.
    void look_up(const double* points, Index count, Index* result) {
        const double small = edge_ / 4, diagonal = small * (std::sqrt(3.0) + 1e-3);
        double origin[3], center[3];
        lowest_corner(points, count, 3, origin);
        const PointCells cells(points, count, 3, origin, small, 0);
        std::vector<PointColumns::Near> found;
        if (grid_.is_too_wide() || cells.is_too_wide) {
            for (Index n = 0; n < count; ++n) result[n] = nearest(points + 3 * n, 0.0, found);
            return;
        }
        const auto move_to = [&](Index key) {
            const Index yz = key % (cells.shape[1] * cells.shape[2]);
            const Index steps[3] = {key / (cells.shape[1] * cells.shape[2]), yz / cells.shape[2], yz % cells.shape[2]};
            for (Index d = 0; d < 3; ++d) center[d] = origin[d] + (double(steps[d]) + 0.5) * small;
        };
        std::vector<Index> strand;
        for (const Index key : cells.keys) {
            move_to(key);
            strand.push_back(only_strand(center, edge_ * (1 - 1e-9) - diagonal));
        }
        count_visits(count + Index(strand.size()));
        std::vector<std::pair<std::int32_t, Index>> others;
        for (Index n = 0; n < count; ++n) {
            result[n] = strand[cells.cell[n]];
            if (result[n] < 0) others.push_back({cells.cell[n], n});
        }
        std::sort(others.begin(), others.end());
        for (std::size_t k = 0; k < others.size(); ++k) {
            if (k == 0 || others[k].first != others[k - 1].first) {
                move_to(cells.keys[others[k].first]);
                nearest(center, diagonal, found);
            }
            result[others[k].second] = nearest_of(found, points + 3 * others[k].second);
        }
    }

private:
    // Collect the points in the 27 cells around the cell of a position, unless they are there from the position before.
    void collect(const double* position) {
        double at[3];
        for (Index d = 0; d < 3; ++d) at[d] = std::floor((position[d] - grid_.origin[d]) / edge_);
        if (std::equal(at, at + 3, at_)) return;
        std::copy(at, at + 3, at_);
        near_.clear();
        is_one_ = true;
        const auto& shape = grid_.cells.shape;
        for (Index d = 0; d < 3; ++d) {
            if (!(at[d] >= 0 && at[d] < double(shape[d]))) return;
        }
        for (Index x = std::max<Index>(Index(at[0]) - 1, 0); x <= std::min(Index(at[0]) + 1, shape[0] - 1); ++x) {
            for (Index y = std::max<Index>(Index(at[1]) - 1, 0); y <= std::min(Index(at[1]) + 1, shape[1] - 1); ++y) {
                const Index row = (x * shape[1] + y) * shape[2], last = row + std::min(Index(at[2]) + 1, shape[2] - 1);
                const auto& keys = grid_.cells.keys;
                auto k = std::lower_bound(keys.begin(), keys.end(), row + std::max<Index>(Index(at[2]) - 1, 0)) - keys.begin();
                for (; k < Index(keys.size()) && keys[k] <= last; ++k) {
                    near_.insert(near_.end(), grid_.order.begin() + grid_.start[k], grid_.order.begin() + grid_.start[k + 1]);
                }
            }
        }
        // those of the cell itself and around it come first, as they are near
        std::rotate(near_.begin(), near_.begin() + near_.size() / 2, near_.end());
        for (const std::int32_t n : near_) is_one_ = is_one_ && strand_[n] == strand_[near_[0]];
    }

    // Return the strand of all points around a position, of which one is no farther than the limit; -1 for several, or none so near.
    Index only_strand(const double* position, double limit) {
        collect(position);
        if (!is_one_) return -1;
        for (const std::int32_t n : near_) {
            if (squared_distance(&points_[3 * Index(n)], position, 3) <= limit * limit) return strand_[n];
        }
        return -1;
    }

    // Return the strand of the nearest point; find those at most `more` farther from the position.
    Index nearest(const double* position, double more, std::vector<PointColumns::Near>& found) const {
        columns_.nearest(position, 1, found);
        const PointColumns::Near first = found[0];
        if (more > 0) {
            columns_.within(position, std::sqrt(first.square) + more, found);
            keep_different(found);
        }
        return strand_[first.index];
    }

    // Keep of repeated points the first: a cloud of few different points may have thousands at each place.
    void keep_different(std::vector<PointColumns::Near>& found) const {
        const auto place = [&](const PointColumns::Near& near) { return &points_[3 * Index(near.index)]; };
        const auto is_before = [&](const auto& a, const auto& b) {
            const auto [x, y] = std::mismatch(place(a), place(a) + 3, place(b));
            return x == place(a) + 3 ? a.index < b.index : *x < *y;
        };
        std::sort(found.begin(), found.end(), is_before);
        const auto is_same = [&](const auto& a, const auto& b) { return std::equal(place(a), place(a) + 3, place(b)); };
        found.erase(std::unique(found.begin(), found.end(), is_same), found.end());
    }

    // Return the strand of the nearest of the points found.
    Index nearest_of(const std::vector<PointColumns::Near>& found, const double* point) const {
        PointColumns::Near best{INFINITY, INT32_MAX};
        for (const PointColumns::Near& near : found) {
            best = std::min(best, {squared_distance(&points_[3 * Index(near.index)], point, 3), near.index});
        }
        return strand_[best.index];
    }

    const std::vector<double>& points_;
    std::vector<Index> strand_;
    double edge_;
    Grouped grid_;
    PointColumns columns_;
    std::vector<std::int32_t> near_;
    double at_[3] = {NAN, NAN, NAN};
    bool is_one_ = true;
};

auto CloudFacts::strand_of(Matrix<double> points) const {
    const Index count = points.shape(0);
    require(points.shape(1) == 3 && count == count_, "points are not (N, 3), as those of the cloud");
    const double* data = points.data();
    for (Index k = 0; k < 3 * count; ++k) require(std::isfinite(data[k]), "a coordinate is not finite");
    const std::vector<Index>& strands = this->strands();
    std::vector<Index> result(count);
    if (!strands.empty() && count) {
        nb::gil_scoped_release released;
        std::vector<double> large;
        std::vector<Index> strand;
        for (Index n = 0; n < size_; ++n) {
            if (strands[n] < 0) continue;
            const double* point = data + 3 * n * every_;
            large.insert(large.end(), point, point + 3);
            strand.push_back(strands[n]);
        }
        StrandLookup(large, std::move(strand), apart_).look_up(data, count, result.data());
    }
    return to_numpy(std::move(result));
}

}  // namespace

void bind_cloud_facts(Module& m) {
    // What the stages ask of the points of a cloud, made once from every k-th of its N points, the sample.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64 m, finite; they are not copied, and must not change
    // sample_points, sample_seeds
    //     points of the sample at least, if there are so many, and seeds among them, around which the density is measured
    // strand_spacings
    //     point spacings; parts of the cloud that are farther apart are strands
    // min_strand_fraction, min_large_fraction
    //     fraction of the points that a strand has at least, and that all strands have together
    Class<CloudFacts>(m, "CloudFacts")
        .def(nb::init<Matrix<double>, Index, Index, double, double, double>(), "points"_a.noconvert(), "sample_points"_a,
             "sample_seeds"_a, "strand_spacings"_a, "min_strand_fraction"_a, "min_large_fraction"_a)
        // Typical distance between neighboring points of a surface in m, at least 1e-6; 1 mm for fewer than two points.
        //
        // It follows from the radius of the disc that holds a point's eight nearest neighbors.
        .def_ro("spacing", &CloudFacts::spacing)
        // Number, from 0, of the strand of each point of the sample, (S,), read-only; -1 in a small part; empty if all touch.
        .def_prop_ro("strands", [](nb::handle_t<CloudFacts> self) {
            const auto& strands = nb::cast<const CloudFacts&>(self).strands();
            return nb::ndarray<nb::numpy, const Index, nb::ndim<1>>(strands.data(), {strands.size()}, self);
        })
        // Drop the points with few neighbors, and average each other point and its neighbors.
        //
        // Points are sorted into cubic cells. The neighbors of a point are all points in its cell and in the 26 cells around, the
        // point itself included.
        //
        // Parameters
        // ----------
        // cell_spacings
        //     edge of a cell in point spacings
        // min_ratio
        //     fraction of the median number of neighbors that a point has at least
        //
        // Returns
        // -------
        // points : (K, 3) m, the points kept; the array of the cloud itself if all are.
        // means : (K, 3) m, for each point kept the mean of its neighbors; the points themselves if the cloud is too wide for such
        //     small cells.
        .def("without_outliers", &CloudFacts::without_outliers, "cell_spacings"_a, "min_ratio"_a)
        // Tell whether two strands of the sample come nearer to each other than `distance` m; False if all touch.
        .def("strands_nearer", &CloudFacts::strands_nearer, "distance"_a)
        // Return the number of the strand that each of the points of the cloud, moved as it may be, is nearest to, (N,).
        //
        // points : (N, 3) float64 m, in the order of the points of the cloud. The strands lie where the points of the sample were
        // moved to. If all touch, the number is 0.
        .def("strand_of", &CloudFacts::strand_of, "points"_a.noconvert());
}
