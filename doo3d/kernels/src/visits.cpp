// How many elements the kernels looked at, for tests that hold the work of a frame to a budget.
#include "arrays.h"

namespace {

thread_local std::uint64_t counted = 0;

std::uint64_t visits() {
    const std::uint64_t count = counted;
    counted = 0;
    return count;
}

}  // namespace

void count_visits(Index count) { counted += std::uint64_t(count); }

void bind_visits(Module& m) {
    // Return how many elements the kernels looked at in this thread since the last call, and start again at 0.
    //
    // Elements are pixels, points, voxels, cells, or pairs of them, with their fixed neighborhoods; bytes that are only cleared or
    // searched for the first that is not 0 count eight as one. Equal arguments give equal counts.
    m.def("visits", &visits);
}
