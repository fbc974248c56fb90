// Medians of many parts of an array.
#include "medians.h"

#include "arrays.h"

namespace {

auto part_medians(Vector<double> values, Vector<Index> first, Vector<Index> last) {
    const Index count = first.shape(0), size = values.shape(0);
    require(Index(last.shape(0)) == count, "first and last have different lengths");
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
    return std::make_tuple(to_numpy(std::move(medians)), to_numpy(std::move(deviations)), to_numpy(std::move(counts)));
}

}  // namespace

void bind_medians(nb::module_& m) {
    m.def("part_medians", &part_medians, "values"_a.noconvert(), "first"_a.noconvert(), "last"_a.noconvert());
}
