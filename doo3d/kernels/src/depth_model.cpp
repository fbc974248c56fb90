// What a depth image says about positions in space.
#include "arrays.h"

#include <algorithm>
#include <limits>

namespace {

const double NEVER = -std::numeric_limits<double>::infinity();

// Log-odds of the states of a position that has a reading; NEVER for a state that the mask excludes.
struct Odds {
    double seen, hidden, free;
    // The numbers of the classes: outside the image, no reading outside the mask, no reading in it, then the states in order.
    Index likeliest() const { return seen >= std::max(hidden, free) ? 3 : hidden >= free ? 4 : 5; }
};

// Differences in inverse depth less the margin there, in deviations of the reading. Their signs are those of the differences of
// depth, exactly: what is between two thresholds has the same class whatever the noise is.
Odds odds_of(double z, double reading, bool on, double margin, bool own_counts, double noise) {
    const double scale = noise * reading * z;
    const double beyond = (reading - (z + margin)) / scale, before = ((z - margin) - reading) / scale;
    if (!on) return {NEVER, -beyond, beyond};
    const double free = own_counts ? beyond : NEVER;
    return {-std::max(before, free), before, free};
}

// The reading at the pixel to which each position projects is compared with the position.
auto classify_positions(StridedMatrix<double> points, Vector<double> camera, Matrix<float> depth, Matrix<bool> mask, double margin,
                        bool own_counts, double noise) {
    require(points.shape(1) == 3 && camera.shape(0) == 4, "points or camera are not (N, 3), (4,)");
    require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
    require(noise > 0, "noise is not above 0");
    ReleasedGil released;
    const Index count = points.shape(0);
    const double height = double(mask.shape(0)), width = double(mask.shape(1));
    std::vector<Index> result(count, 0), behind, pixels;
    std::vector<double> log_odds(3 * count, 0.0), readings;
    count_visits(count);
    for (Index n = 0; n < count; ++n) {
        const double z = points(n, 2);
        const double u = camera(0) * points(n, 0) / z + camera(2), v = camera(1) * points(n, 1) / z + camera(3);
        if (!(z > 0 && u > -0.5 && v > -0.5 && u < width - 0.5 && v < height - 0.5)) continue;
        const Index column = Index(std::nearbyint(u)), row = Index(std::nearbyint(v));
        const double reading = depth(row, column);
        const bool on = mask(row, column);
        if (reading <= 0) {
            result[n] = on ? 2 : 1;
            continue;
        }
        const Odds odds = odds_of(z, reading, on, margin, own_counts, noise);
        result[n] = odds.likeliest();
        log_odds[3 * n] = odds.seen, log_odds[3 * n + 1] = odds.hidden, log_odds[3 * n + 2] = odds.free;
        if (result[n] == 4 && !on && reading >= z - margin) {
            behind.push_back(n);
            pixels.insert(pixels.end(), {column, row});
            readings.push_back(reading);
        }
    }
    const std::size_t number = behind.size();
    released.end();
    return std::make_tuple(to_numpy(std::move(result)), to_numpy(std::move(log_odds), std::size_t(count), 3), to_numpy(std::move(behind)),
                           to_numpy(std::move(pixels), number, 2), to_numpy(std::move(readings)));
}

}  // namespace

void bind_depth_model(nb::module_& m) {
    m.def("classify_positions", &classify_positions, "points"_a.noconvert(), "camera"_a.noconvert(), "depth"_a.noconvert(),
          "mask"_a.noconvert(), "margin"_a, "own_counts"_a, "noise"_a);
}
