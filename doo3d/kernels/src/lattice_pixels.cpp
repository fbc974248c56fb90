#include "runs.h"

namespace {

// Return how far the lattice is shifted from row to row: about the golden section of the step, and coprime to it, so that the lattice
// is nearly as fine in every direction.
Index slope_of(Index step, double golden) {
    Index best = 0;
    for (Index k = 1; k < step; ++k) {
        const bool nearer = best == 0 || std::fabs(double(k) - double(step) / golden) < std::fabs(double(best) - double(step) / golden);
        if (nearer && std::gcd(k, step) == 1) best = k;
    }
    return best;
}

// The pixels of each column are counted first, so that the columns can be filled row by row.
auto lattice_pixels(Matrix<bool> mask, Index most, double golden) {
    require(most > 0 && golden > 1, "most is not positive, or golden is not more than 1");
    const Index height = mask.shape(0), width = mask.shape(1);
    require(height < INT32_MAX && width < INT32_MAX, "the mask is too large");
    std::vector<double> found;
    Index count = 0;
    {
        nb::gil_scoped_release released;
        const std::vector<Run> runs = runs_of(bytes_of(mask), height, width);
        for (const Run& run : runs) count += run.end - run.start;
        const Index step = std::max<Index>(1, (count + most - 1) / most), slope = slope_of(step, golden);
        const auto for_each_kept = [&](auto visit) {
            for (const Run& run : runs) {
                const Index shift = slope * (run.row % step) % step;
                for (Index u = run.start + (step - (run.start + shift) % step) % step; u < run.end; u += step) visit(u, run.row);
            }
        };
        std::vector<Index> next(width + 1);
        for_each_kept([&](Index u, Index) { ++next[u + 1]; });
        for (Index u = 0; u < width; ++u) next[u + 1] += next[u];
        found.resize(2 * next[width]);
        for_each_kept([&](Index u, Index row) {
            double* pixel = found.data() + 2 * next[u]++;
            pixel[0] = double(u);
            pixel[1] = double(row);
        });
    }
    const std::size_t kept = found.size() / 2;
    return std::make_tuple(to_numpy(std::move(found), kept, 2), double(count) / double(std::max<std::size_t>(1, kept)));
}

}  // namespace

void bind_lattice_pixels(Module& m) {
    // Return about `most` True pixels of a mask, evenly distributed, as (u, v) = (column, row), sorted by u and then v.
    //
    // Parameters
    // ----------
    // mask
    //     (H, W) bool
    // most
    //     number of pixels, about; all are returned if there are not more
    // golden
    //     the golden section, more than 1: of every `step` pixels of a row one is returned, shifted from row to row by about
    //     step / golden
    //
    // Returns
    // -------
    // (K, 2) float64 px, and the number of pixels of the mask that each stands for.
    m.def("lattice_pixels", &lattice_pixels, "mask"_a.noconvert(), "most"_a, "golden"_a);
}
