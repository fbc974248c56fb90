// Clearance of a path from other paths.
#include "arrays.h"

static Index first_clear(Matrix<double> points, Matrix<double> others, double clearance) {
    const Index count = points.shape(0), other_count = others.shape(0), dim = points.shape(1);
    require(count > 0 && dim > 0, "points are empty, expected at least one");
    require(other_count == 0 || Index(others.shape(1)) == dim, "points and others have different numbers of coordinates");
    for (Index i = 0; i < count; ++i) {
        double nearest = INFINITY;
        for (Index j = 0; j < other_count; ++j) {
            nearest = least(nearest, squared_distance(points.data() + i * dim, others.data() + j * dim, dim));
        }
        if (std::sqrt(nearest) > clearance) return i;
    }
    return count - 1;
}

void bind_clearance(nb::module_& m) {
    m.def("first_clear", &first_clear, "points"_a.noconvert(), "others"_a.noconvert(), "clearance"_a);
}
