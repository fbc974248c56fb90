// Medians of many parts of an array, and percentiles.
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
    // Return percentiles (Q,) of the finite ones of values (N,), interpolated linearly as NumPy does; NaN without any.
    //
    // percents : (Q,) 0 to 100.
    m.def("percentiles", &percentiles, "values"_a.noconvert(), "percents"_a.noconvert());
}
