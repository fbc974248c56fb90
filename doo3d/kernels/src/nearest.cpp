// Nearest targets of many points that lie near them, and sums over the points of each target.
#include "arrays.h"

#include <algorithm>
#include <array>

namespace {

// Points in a row that may share one set of candidate targets.
constexpr Index MAX_GROUP = 16;

using Point = std::array<double, 3>;

double square_between(const Point& p, const Point& q) {
    const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    return x * x + y * y + z * z;
}

Point point_of(const double* row, Index dim) {
    Point p{};
    for (Index d = 0; d < dim; ++d) p[d] = row[d];
    return p;
}

// The targets sorted into the cells of a box, of edge `reach`, doubled until the number of cells is in proportion to the targets.
class Cells {
public:
    Cells(const Matrix<double>& targets, double reach) : dim_(targets.shape(1)), edge_(reach) {
        const Index size = targets.shape(0);
        Point high{};
        for (Index d = 0; d < dim_; ++d) {
            low_[d] = high[d] = targets(0, d);
            for (Index s = 1; s < size; ++s) {
                low_[d] = std::min(low_[d], targets(s, d));
                high[d] = std::max(high[d], targets(s, d));
            }
        }
        for (;; edge_ *= 2) {
            double cells = 1.0;
            for (Index d = 0; d < dim_; ++d) cells *= std::floor((high[d] - low_[d]) / edge_) + 1;
            if (cells <= 64.0 * double(size) + 4096.0) break;
        }
        for (Index d = 0; d < dim_; ++d) shape_[d] = Index((high[d] - low_[d]) / edge_) + 1;
        start_.assign(shape_[0] * shape_[1] * shape_[2] + 1, 0);
        std::vector<Index> cell(size);
        for (Index s = 0; s < size; ++s) {
            for (Index d = 0; d < dim_; ++d) cell[s] = cell[s] * shape_[d] + Index((targets(s, d) - low_[d]) / edge_);
            ++start_[cell[s] + 1];
        }
        for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
        std::vector<Index> filled(start_.begin(), start_.end() - 1);
        order.resize(size);
        positions.resize(size);
        for (Index s = 0; s < size; ++s) {
            const Index k = filled[cell[s]]++;
            order[k] = s;
            positions[k] = point_of(targets.data() + s * dim_, dim_);
        }
        candidates_.resize(size);
        squares_.resize(size);
    }

    // Collect the targets in the cells within `margin` of p; return the least distance from p.
    double collect(const Point& p, double margin) {
        std::array<Index, 3> first{0, 0, 0}, last{1, 1, 1};
        for (Index d = 0; d < dim_; ++d) {
            const double cells = double(shape_[d]);
            first[d] = Index(std::min(std::max(std::floor((p[d] - margin - low_[d]) / edge_), 0.0), cells));
            last[d] = Index(std::min(std::max(std::floor((p[d] + margin - low_[d]) / edge_) + 1, 0.0), cells));
        }
        double best = INFINITY;
        size_ = 0;
        for (Index a = first[0]; a < last[0]; ++a) {
            for (Index b = first[1]; b < last[1]; ++b) {
                const Index row = (a * shape_[1] + b) * shape_[2];
                for (Index k = start_[row + first[2]]; k < start_[std::max(row + first[2], row + last[2])]; ++k) {
                    candidates_[size_] = k;
                    squares_[size_] = square_between(p, positions[k]);
                    best = std::min(best, squares_[size_]);
                    ++size_;
                }
            }
        }
        return std::sqrt(best);
    }

    // Keep the collected targets whose squared distance is at most `limit`.
    void keep_within(double limit) {
        Index kept = 0;
        for (Index k = 0; k < size_; ++k) {
            if (squares_[k] <= limit) candidates_[kept++] = candidates_[k];
        }
        size_ = kept;
    }

    // Return the least squared distance of p from the collected targets, and whose it is; of several equal ones the first.
    std::pair<double, Index> nearest_collected(const Point& p) const {
        double best = INFINITY;
        Index owner = 0;
        for (Index c = 0; c < size_; ++c) consider(p, candidates_[c], best, owner);
        return {best, owner};
    }

    // The same for all targets.
    std::pair<double, Index> nearest_of_all(const Point& p) const {
        double best = INFINITY;
        Index owner = 0;
        for (Index k = 0; k < Index(order.size()); ++k) consider(p, k, best, owner);
        return {best, owner};
    }

    std::vector<Index> order;       // the index of each sorted target
    std::vector<Point> positions;  // its position, 0 along axes beyond D

private:
    void consider(const Point& p, Index k, double& best, Index& owner) const {
        const double square = square_between(p, positions[k]);
        if (square < best || (square == best && order[k] < owner)) {
            best = square;
            owner = order[k];
        }
    }

    Index dim_;
    double edge_;
    Point low_{};
    std::array<Index, 3> shape_{1, 1, 1};
    std::vector<Index> start_, candidates_;
    std::vector<double> squares_;
    Index size_ = 0;
};

// Return the end of the run of points from n on that lie within `slack` of point n.
Index group_end(const Matrix<double>& points, Index n, double slack) {
    const Index dim = points.shape(1), stop = std::min(Index(points.shape(0)), n + MAX_GROUP);
    Index end = n + 1;
    while (end < stop && squared_distance(points.data() + n * dim, points.data() + end * dim, dim) <= slack * slack) ++end;
    return end;
}

// The targets are sorted into cells of edge `reach`. Points that follow each other in the list are often neighbors, as the pixels
// of a mask are, so up to MAX_GROUP of them that lie within reach / 5 of the first share its candidates: the targets in the
// cells around it, without those too far from the first to be the nearest of any (its nearest plus twice the slack). A point
// without a target within reach is compared with all targets, unless the search is limited.
auto nearest(Matrix<double> points, Matrix<double> targets, double reach, bool limited) {
    const Index count = points.shape(0), size = targets.shape(0), dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(targets.shape(1)) == dim, "points and targets have different numbers of coordinates");
    require(reach > 0 && std::isfinite(reach), "reach is not positive and finite");
    for (Index k = 0; k < size * dim; ++k) require(std::isfinite(targets.data()[k]), "a target is not finite");
    std::vector<double> distance(count, INFINITY);
    std::vector<Index> index(count);
    if (size > 0 && count > 0) {
        Cells cells(targets, reach);
        const double slack = reach / 5;
        for (Index n = 0; n < count;) {
            const Index end = group_end(points, n, slack);
            const double shared = end > n + 1 ? slack : 0.0;
            const double closest = cells.collect(point_of(points.data() + n * dim, dim), reach + shared);
            if (closest <= reach) {
                const double limit = closest + 2 * shared;
                cells.keep_within(limit * limit * (1 + 1e-9));
            }
            for (Index i = n; i < end; ++i) {
                const Point p = point_of(points.data() + i * dim, dim);
                std::pair<double, Index> best = cells.nearest_collected(p);
                if (best.first > reach * reach) {
                    if (limited) continue;
                    best = cells.nearest_of_all(p);
                }
                distance[i] = std::sqrt(best.first);
                index[i] = best.second;
            }
            n = end;
        }
    }
    return std::make_tuple(to_numpy(std::move(distance)), to_numpy(std::move(index)));
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
    std::vector<double> kept, along, offsets;
    for (Index n = 0; n < count; ++n) {
        const double* point = points.data() + n * dim;
        bool inside = true;
        double ahead = 0.0, square = 0.0;
        for (Index d = 0; d < dim; ++d) {
            const double step = point[d] - origin(d);
            inside = inside && std::fabs(step) < half_edge;
            ahead += step * direction(d);
        }
        if (!inside) continue;
        for (Index d = 0; d < dim; ++d) {
            const double lateral = point[d] - origin(d) - ahead * direction(d);
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
    m.def("points_near_line", &points_near_line, "points"_a.noconvert(), "origin"_a.noconvert(), "direction"_a.noconvert(),
          "half_edge"_a, "max_offset"_a);
}
