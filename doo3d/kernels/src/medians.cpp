// Medians of many parts of an array, percentiles, and values at a rank in groups.
#include "medians.h"

#include "arrays.h"

namespace {

auto part_medians(Vector<double> values, Vector<Index> first, Vector<Index> last) {
    const Index count = first.shape(0), size = values.shape(0);
    require(Index(last.shape(0)) == count, "first and last have different lengths");
    ReleasedGil released;
    std::vector<double> medians(count, NAN), deviations(count, NAN), part;
    std::vector<Index> counts(count);
    for (Index k = 0; k < count; ++k) {
        require(first(k) >= 0 && last(k) <= size, "a part lies outside the values");
        count_visits(last(k) - first(k));
        part.clear();
        for (Index i = first(k); i < last(k); ++i) {
            if (std::isfinite(values(i))) part.push_back(values(i));
        }
        counts[k] = Index(part.size());
        if (part.empty()) continue;
        medians[k] = median(part);
        for (double& value : part) value = std::fabs(value - medians[k]);
        deviations[k] = median(part);
    }
    released.end();
    return std::make_tuple(to_numpy(std::move(medians)), to_numpy(std::move(deviations)), to_numpy(std::move(counts)));
}

auto percentiles(Vector<double> values, Vector<double> percents) {
    count_visits(Index(values.shape(0)));
    std::vector<double> sorted, result(percents.shape(0), NAN);
    for (std::size_t i = 0; i < values.shape(0); ++i) {
        if (std::isfinite(values(i))) sorted.push_back(values(i));
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t q = 0; q < result.size(); ++q) {
        require(percents(q) >= 0 && percents(q) <= 100, "a percentile is not between 0 and 100");
        if (sorted.empty()) continue;
        const double at = double(sorted.size() - 1) * (percents(q) / 100);
        const std::size_t first = std::size_t(at), second = std::min(first + 1, sorted.size() - 1);
        const double share = at - double(first), step = sorted[second] - sorted[first];
        result[q] = share < 0.5 ? sorted[first] + step * share : sorted[second] - step * (1 - share);
    }
    return to_numpy(std::move(result));
}

auto middle_medians(Volume<double> values) {
    const std::size_t outer = values.shape(0), count = values.shape(1), inner = values.shape(2);
    require(count > 0, "the second axis is empty");
    count_visits(Index(values.size()));
    ReleasedGil released;
    std::vector<double> medians(outer * inner), part(count);
    for (std::size_t i = 0; i < outer; ++i) {
        for (std::size_t k = 0; k < inner; ++k) {
            for (std::size_t j = 0; j < count; ++j) part[j] = values.data()[(i * count + j) * inner + k];
            medians[i * inner + k] = median(part);
        }
    }
    released.end();
    return to_numpy(std::move(medians), outer, inner);
}

auto upper_of_groups(Vector<double> values, Vector<Index> group, Index groups, double share) {
    const Index size = values.shape(0);
    require(Index(group.shape(0)) == size, "group is not one per value");
    require(groups >= 0 && share >= 0 && share <= 1, "groups is negative, or share is not from 0 to 1");
    std::vector<Index> start(groups + 2), count(groups);
    std::vector<double> sorted(size), result(groups);
    count_visits(2 * size + groups);
    for (Index n = 0; n < size; ++n) {
        require(group(n) >= 0 && group(n) < groups, "a group is out of bounds");
        ++start[group(n) + 2];
    }
    for (Index g = 2; g < groups + 2; ++g) start[g] += start[g - 1];
    for (Index n = 0; n < size; ++n) sorted[start[group(n) + 1]++] = values(n);
    for (Index g = 0; g < groups; ++g) {
        const auto first = sorted.begin() + start[g], last = sorted.begin() + start[g + 1];
        count[g] = last - first;
        if (first == last) continue;
        const auto wanted = last - 1 - Index(std::floor(share * double(count[g] - 1)));
        std::nth_element(first, wanted, last);
        result[g] = *wanted;
    }
    return std::make_tuple(to_numpy(std::move(result)), to_numpy(std::move(count)));
}

}  // namespace

void bind_medians(Module& m) {
    // Return the medians of parts of an array, without values that are not finite.
    //
    // Parameters
    // ----------
    // values
    //     (N,) float64
    // first, last
    //     (K,) int64; part k is values[first[k]:last[k]]
    //
    // Returns
    // -------
    // median, deviation : (K,) float64, the median of each part, and the median of the absolute differences from it; NaN without
    //     values
    // count : (K,) int64, number of finite values
    m.def("part_medians", &part_medians, "values"_a.noconvert(), "first"_a.noconvert(), "last"_a.noconvert());
    // Return the medians (A, C) of finite values (A, B, C) over the second axis, of at least one value, as NumPy takes them.
    m.def("middle_medians", &middle_medians, "values"_a.noconvert());
    // Return percentiles (Q,) of the finite ones of values (N,), interpolated linearly as NumPy does; NaN without any.
    //
    // percents : (Q,) 0 to 100.
    m.def("percentiles", &percentiles, "values"_a.noconvert(), "percents"_a.noconvert());
    // Return the value below the uppermost share of the values of each group.
    //
    // Parameters
    // ----------
    // values
    //     (N,) float64
    // group
    //     (N,) int64, the group of each value
    // groups
    //     number of groups
    // share
    //     share of the other values of a group that are above the value returned, 0 to 1, rounded down
    //
    // Returns
    // -------
    // value : (groups,) float64, 0 for a group without values
    // count : (groups,) int64, number of values in each
    m.def("upper_of_groups", &upper_of_groups, "values"_a.noconvert(), "group"_a.noconvert(), "groups"_a, "share"_a);
}
