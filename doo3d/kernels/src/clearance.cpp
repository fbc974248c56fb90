// Clearance of paths that leave one place from each other.
#include "clearance.h"

#include <algorithm>
#include <array>

namespace {

// Some of the points, sorted into cells whose edge is the clearance or longer.
class Cells {
public:
    // edge grows until the number of cells is in proportion to the points
    Cells(const std::vector<double>& points, Index dim, const std::vector<Index>& rows, double clearance)
        : dim_(dim), edge_(clearance * (1 + 1e-9)) {
        std::array<double, 3> high{};
        for (Index d = 0; d < dim_; ++d) {
            low_[d] = INFINITY;
            high[d] = -INFINITY;
            for (const Index row : rows) {
                low_[d] = std::min(low_[d], points[row * dim_ + d]);
                high[d] = std::max(high[d], points[row * dim_ + d]);
            }
            if (rows.empty()) low_[d] = high[d] = 0.0;
            edge_ = std::max(edge_, (high[d] - low_[d]) / 1e6);
        }
        if (!(edge_ > 0)) edge_ = 1.0;
        for (;; edge_ *= 2) {
            double cells = 1.0;
            for (Index d = 0; d < dim_; ++d) cells *= std::floor((high[d] - low_[d]) / edge_) + 1;
            if (cells <= 4.0 * double(rows.size()) + 64.0) break;
        }
        for (Index d = 0; d < dim_; ++d) shape_[d] = Index((high[d] - low_[d]) / edge_) + 1;
        start_.assign(shape_[0] * shape_[1] * shape_[2] + 1, 0);
        std::vector<Index> cell(rows.size());
        for (std::size_t k = 0; k < rows.size(); ++k) {
            for (Index d = 0; d < dim_; ++d) cell[k] = cell[k] * shape_[d] + Index((points[rows[k] * dim_ + d] - low_[d]) / edge_);
            ++start_[cell[k] + 1];
        }
        for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
        std::vector<Index> filled(start_.begin(), start_.end() - 1);
        order_.resize(rows.size());
        for (std::size_t k = 0; k < rows.size(); ++k) order_[filled[cell[k]]++] = rows[k];
    }

    // Tell whether `near` holds for a point in the cell of a point or those beside it: no other is within an edge of it.
    template <class Near>
    bool any(const double* point, const Near& near) const {
        std::array<Index, 3> first{0, 0, 0}, last{0, 0, 0};
        for (Index d = 0; d < dim_; ++d) {
            const double cell = std::floor((point[d] - low_[d]) / edge_);
            if (!(cell >= -1 && cell <= double(shape_[d]))) return false;
            first[d] = std::max<Index>(Index(cell) - 1, 0);
            last[d] = std::min<Index>(Index(cell) + 1, shape_[d] - 1);
        }
        for (Index a = first[0]; a <= last[0]; ++a) {
            for (Index b = first[1]; b <= last[1]; ++b) {
                const Index row = (a * shape_[1] + b) * shape_[2];
                for (Index k = start_[row + first[2]]; k < start_[row + last[2] + 1]; ++k) {
                    if (near(order_[k])) return true;
                }
            }
        }
        return false;
    }

private:
    Index dim_;
    double edge_;
    std::array<double, 3> low_{};
    std::array<Index, 3> shape_{1, 1, 1};
    std::vector<Index> start_, order_;
};

}  // namespace

std::vector<Index> first_clear(const std::vector<double>& points, Index dim, const std::vector<Index>& bounds,
                               const std::vector<Index>& counts, const std::vector<Index>& limits, double clearance) {
    const Index size = bounds.back(), lines = Index(counts.size());
    std::vector<Index> line(size), rows, first(lines);
    for (Index e = 0; e < lines; ++e) {
        for (Index row = bounds[e]; row < bounds[e + 1]; ++row) {
            line[row] = e;
            if (row - bounds[e] < limits[e]) rows.push_back(row);
        }
    }
    const Cells cells(points, dim, rows, clearance);
    Visits visits{size + Index(rows.size())};
    for (Index e = 0; e < lines; ++e) {
        const Index count = counts[e], own = std::min(count, bounds[e + 1] - bounds[e]);
        first[e] = own - 1;
        for (Index i = 0; i < own; ++i) {
            const double* point = points.data() + (bounds[e] + i) * dim;
            const bool close = !rows.empty() && cells.any(point, [&](Index row) {
                ++visits.count;
                const Index other = line[row];
                return other != e && row - bounds[other] < count &&
                       !(std::sqrt(squared_distance(point, points.data() + row * dim, dim)) > clearance);
            });
            if (!close) {
                first[e] = i;
                break;
            }
        }
    }
    return first;
}
