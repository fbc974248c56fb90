// A part of the True pixels of a mask, evenly distributed.
#include "lattice_pixels.h"

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

}  // namespace

// The pixels of each column are counted first, so that the columns can be filled row by row.
LatticePixels lattice_of(const std::vector<Run>& runs, Index width, Index most, double golden) {
    LatticePixels found;
    for (const Run& run : runs) found.count += run.end - run.start;
    const Index step = std::max<Index>(1, (found.count + most - 1) / most), slope = slope_of(step, golden);
    const auto for_each_kept = [&](auto visit) {
        for (const Run& run : runs) {
            const Index shift = slope * (run.row % step) % step;
            for (Index u = run.start + (step - (run.start + shift) % step) % step; u < run.end; u += step) visit(u, run.row);
        }
    };
    std::vector<Index> next(width + 1);
    for_each_kept([&](Index u, Index) { ++next[u + 1]; });
    for (Index u = 0; u < width; ++u) next[u + 1] += next[u];
    found.pixels.resize(2 * next[width]);
    count_visits(next[width]);
    for_each_kept([&](Index u, Index row) {
        double* pixel = found.pixels.data() + 2 * next[u]++;
        pixel[0] = double(u);
        pixel[1] = double(row);
    });
    return found;
}
