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

void bind_visits(nb::module_& m) { m.def("visits", &visits); }
