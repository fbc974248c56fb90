#include "cells.h"

namespace {

// Share of the samples that is compared, one of so many, so that no more pairs are visited than allowed.
Index stride_of(const std::vector<double>& places, double reach, double max_pairs) {
    const Index count = Index(places.size()) / 2;
    double pairs = 0.0;
    if (double(count) * double(count) <= max_pairs) return 1;
    const Cells cells(places.data(), count, 2, reach / CELLS_PER_REACH);
    for (Index i = 0; i < count; ++i) cells.for_each_run(places.data() + 2 * i, reach, [&](Index begin, Index end) { pairs += double(end - begin); });
    Index stride = 1;
    for (; pairs > max_pairs; pairs /= 4) stride *= 2;
    return stride;
}

// A sample is compared with the samples in the cells around it, each until one is found beside it.
auto strands_beside(Matrix<double> view, Matrix<double> tangents, Vector<Index> bounds, Vector<double> reach, Vector<double> along,
                    Vector<double> around, double reaches, double apart, double min_cosine, double max_pairs) {
    const Index count = view.shape(0);
    require(view.shape(1) == 2 && tangents.shape(1) == 2 && Index(tangents.shape(0)) == count, "view and tangents are not (S, 2)");
    check_bounds(bounds, count);
    require(Index(reach.shape(0)) == count && Index(along.shape(0)) == count, "reach and along are not one per sample");
    require(around.shape(0) + 1 == bounds.shape(0), "around is not one per chain");
    require(reaches > 0 && std::isfinite(reaches) && max_pairs > 0, "reaches and max_pairs are not positive");
    double most = 0.0;
    for (Index i = 0; i < count; ++i) {
        require(std::isfinite(view(i, 0)) && std::isfinite(view(i, 1)) && std::isfinite(reach(i)), "a sample is not finite");
        most = std::max(most, reaches * reach(i));
    }
    std::vector<std::uint8_t> found(count);
    if (most > 0) {
        nb::gil_scoped_release released;
        std::vector<double> places(view.data(), view.data() + 2 * count);
        const Index stride = stride_of(places, most, max_pairs);
        std::vector<Index> taken, chain;
        places.clear();
        for (std::size_t c = 0; c + 1 < bounds.shape(0); ++c) chain.insert(chain.end(), bounds(c + 1) - bounds(c), Index(c));
        for (Index i = 0; i < count; i += stride) {
            taken.push_back(i);
            places.insert(places.end(), {view(i, 0), view(i, 1)});
        }
        const Cells cells(places.data(), Index(taken.size()), 2, most / CELLS_PER_REACH);
        const auto is_beside = [&](Index i, Index j) {
            if (chain[i] == chain[j]) {
                const double between = std::fabs(along(i) - along(j));
                if (!(std::min(between, std::fabs(around(chain[i]) - between)) > apart)) return false;
            }
            const double du = view(i, 0) - view(j, 0), dv = view(i, 1) - view(j, 1);
            if (!(std::sqrt(du * du + dv * dv) < reaches * std::max(reach(i), reach(j)))) return false;
            return std::fabs(tangents(i, 0) * tangents(j, 0) + tangents(i, 1) * tangents(j, 1)) > min_cosine;
        };
        for (const Index i : taken) {
            const double at[2] = {view(i, 0), view(i, 1)};
            cells.for_each_around(at, most, [&](Index k) { found[i] = found[i] || is_beside(i, taken[cells.order[k]]); });
            for (Index k = i; k < std::min(i + stride, count); ++k) found[k] = found[i];
        }
    }
    return to_numpy_bool(found);
}

}  // namespace

void bind_strands_beside(Module& m) {
    // Tell which samples of chains have another strand beside them in the view, nearly parallel.
    //
    // Parameters
    // ----------
    // view, tangents
    //     (S, 2) float64, position in the view of S samples, of C chains one after the other, and the unit tangent there
    // bounds
    //     (C + 1,) int64; chain c has the samples [bounds[c]:bounds[c + 1]], the last entry is S
    // reach, along
    //     (S,) float64, radius of the strand in the view, and position along the chain
    // around
    //     (C,) float64, length of a closed chain, in the unit of `along`; infinite for an open one
    // reaches
    //     two strands are beside each other if they are nearer than this many of the larger `reach`
    // apart
    //     difference of `along` from which on two samples of one chain are of two strands
    // min_cosine
    //     cosine of the angle between the two strands at least
    // max_pairs
    //     pairs of samples that are compared at most, or one of two samples, of four and so on is taken for its neighbors
    //
    // Returns
    // -------
    // (S,) bool
    m.def("strands_beside", &strands_beside, "view"_a.noconvert(), "tangents"_a.noconvert(), "bounds"_a.noconvert(), "reach"_a.noconvert(), "along"_a.noconvert(),
          "around"_a.noconvert(), "reaches"_a, "apart"_a, "min_cosine"_a, "max_pairs"_a);
}
