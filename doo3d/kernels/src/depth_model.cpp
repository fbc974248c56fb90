#include "position_classes.h"

#include <algorithm>
#include <limits>

namespace {

const double NEVER = -std::numeric_limits<double>::infinity();

// Log-odds of the states of a position that has a reading; NEVER for a state that the mask excludes.
struct Odds {
    double seen, hidden, free;
    Index likeliest() const { return seen >= std::max(hidden, free) ? SURFACE : hidden >= free ? HIDDEN : FREE; }
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

// What is found of all positions.
struct Found {
    std::vector<Index> classes, behind, pixels;
    std::vector<double> odds, readings;

    explicit Found(Index count) : classes(count, OUTSIDE), odds(3 * count, 0.0) { count_visits(count); }
    void add(Index n, const Odds& each) {
        classes[n] = each.likeliest();
        odds[3 * n] = each.seen, odds[3 * n + 1] = each.hidden, odds[3 * n + 2] = each.free;
    }
};

// In 2-D the mask decides: positions are pixels.
void classify_pixels(const StridedMatrix<double>& points, const Matrix<bool>& mask, Found& found) {
    const double height = double(mask.shape(0)), width = double(mask.shape(1));
    for (Index n = 0; n < Index(points.shape(0)); ++n) {
        const double u = points(n, 0), v = points(n, 1);
        if (!(u > -0.5 && v > -0.5 && u < width - 0.5 && v < height - 0.5)) continue;
        const bool on = bytes_of(mask)[Index(std::nearbyint(v)) * Index(mask.shape(1)) + Index(std::nearbyint(u))];
        found.add(n, {on ? -NEVER : NEVER, NEVER, on ? NEVER : -NEVER});
    }
}

auto classify_positions(StridedMatrix<double> points, Vector<double> camera, Matrix<float> depth, Matrix<bool> mask, double margin,
                        bool own_counts, double noise) {
    const bool planar = camera.shape(0) == 0;
    require(points.shape(1) == (planar ? 2 : 3) && (planar || camera.shape(0) == 4), "points or camera are not (N, 3), (4,)");
    require(planar || (depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1)), "depth and mask have different shapes");
    require(noise > 0, "noise is not above 0");
    ReleasedGil released;
    const Index count = points.shape(0);
    const double height = double(mask.shape(0)), width = double(mask.shape(1));
    Found found(count);
    if (planar) classify_pixels(points, mask, found);
    for (Index n = 0; n < count && !planar; ++n) {
        const double z = points(n, 2);
        const double u = camera(0) * points(n, 0) / z + camera(2), v = camera(1) * points(n, 1) / z + camera(3);
        if (!(z > 0 && u > -0.5 && v > -0.5 && u < width - 0.5 && v < height - 0.5)) continue;
        const Index column = Index(std::nearbyint(u)), row = Index(std::nearbyint(v));
        const double reading = depth(row, column);
        const bool on = mask(row, column);
        if (reading <= 0) {
            found.classes[n] = on ? MASKED : NO_DEPTH;
            continue;
        }
        found.add(n, odds_of(z, reading, on, margin, own_counts, noise));
        if (found.classes[n] == HIDDEN && !on && reading >= z - margin) {
            found.behind.push_back(n);
            found.pixels.insert(found.pixels.end(), {column, row});
            found.readings.push_back(reading);
        }
    }
    const std::size_t number = found.behind.size();
    released.end();
    return std::make_tuple(to_numpy(std::move(found.classes)), to_numpy(std::move(found.odds), std::size_t(count), 3),
                           to_numpy(std::move(found.behind)), to_numpy(std::move(found.pixels), number, 2), to_numpy(std::move(found.readings)));
}

}  // namespace

void bind_depth_model(Module& m) {
    // Tell what a depth image says about positions in space, each compared with the reading at the pixel that it projects to.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64 m in the camera's optical frame, or (N, 2) px in 2-D
    // camera
    //     (4,) float64, the intrinsics fx, fy, cx, cy in px; (0,) in 2-D, where positions in the mask are 3, and others 5
    // depth, mask
    //     (H, W) float32 m, 0 = no reading, not used in 2-D, and (H, W) bool, the object
    // margin
    //     m by which a reading is behind a position to show that it is free, or in front of it to hide it
    // own_counts
    //     True if a reading in the mask also shows that a position in front of it is free
    // noise
    //     1/m, standard deviation of the readings in inverse depth, above 0
    //
    // Returns
    // -------
    // class : (N,) int64: 0 outside the image, 1 no reading outside the mask, 2 no reading in the mask, 3 surface of the object,
    //     4 hidden, 5 free
    // log_odds : (N, 3) nat, of the last three; minus infinity where the mask excludes one, 0 where there is no reading
    // behind : (K,) int64, the hidden positions outside the mask whose reading is not nearer by the margin
    // pixels, readings : (K, 2) int64, the pixel (u, v) of each of these, and (K,) float64 m, the reading there
    m.def("classify_positions", &classify_positions, "points"_a.noconvert(), "camera"_a.noconvert(), "depth"_a.noconvert(),
          "mask"_a.noconvert(), "margin"_a, "own_counts"_a, "noise"_a);
}
