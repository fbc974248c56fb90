// Sums over the points in the cross-sections of samples.
#pragma once

#include "pooling.h"

// Sums over the points of each sample, and of its neighbors on the same path: one column for each value of a point.
class PooledSums {
public:
    PooledSums(const Vector<Index>& sample, const Vector<Index>& path, Index half) : sample_(sample), path_(dense(path)), half_(half) {
        require(half >= 0, "half is negative");
        const Index size = path.shape(0);
        for (std::size_t k = 0; k < sample.shape(0); ++k) {
            require(sample(k) >= 0 && sample(k) < size, "an index lies outside the samples");
        }
    }

    // Call `values(k)`, which returns an array of values of point k; return the sums, one vector for each.
    template <class PointValues>
    auto of(PointValues values) const {
        constexpr std::size_t columns = std::tuple_size_v<decltype(values(Index(0)))>;
        std::array<std::vector<double>, columns> sums;
        for (auto& column : sums) column.resize(path_.size());
        for (std::size_t k = 0; k < sample_.shape(0); ++k) {
            const auto row = values(Index(k));
            for (std::size_t c = 0; c < columns; ++c) sums[c][sample_(k)] += row[c];
        }
        for (auto& column : sums) column = pooled(column.data(), path_, half_);
        return sums;
    }

private:
    const Vector<Index>& sample_;
    const std::vector<Index> path_;
    Index half_;
};
