#include "plane_rise.h"
#include "order_statistics.h"

namespace {

double height_over(const double* plane, const double* point) {
    return plane[0] * point[0] + plane[1] * point[1] + plane[2] * point[2] - plane[3];
}

// Append the height over the plane of what is seen at a position beside the mask, if anything is.
void add_height(const PlaneView& view, const double* point, std::vector<double>& heights) {
    const Camera& camera = *view.camera;
    double at[2];
    camera.project(point, at);
    const double u = std::nearbyint(at[0]), v = std::nearbyint(at[1]), reading = view.readings.at(u, v, false);
    if (std::isnan(reading)) return;
    const double seen[3] = {(u - camera.cx) / camera.fx * reading, (v - camera.cy) / camera.fy * reading, reading};
    heights.push_back(height_over(view.plane, seen));
}

}  // namespace

WITH_AVX2 void raise_to_plane(const SampleAxes& samples, const std::vector<double>& radius, const PlaneView& view,
                              std::vector<double>& target) {
    std::vector<double> heights;
    Visits visits{samples.size};
    for (Index s = 0; s < samples.size; ++s) {
        const double *point = samples.positions + 3 * s, *lateral = samples.lateral + 3 * s, *away = samples.behind + 3 * s;
        const double low = height_over(view.plane, target.data() + 3 * s);
        const double slope = -(away[0] * view.plane[0] + away[1] * view.plane[1] + away[2] * view.plane[2]);
        if (!(low < radius[s] && low > -view.sunk_radii * radius[s] && slope > 0)) continue;
        heights.clear();
        const Index readings = 2 * Index(view.beside.size());
        visits.count += readings;
        for (Index b = 0; b < readings; ++b) {
            const double offset = (b % 2 ? 1.0 : -1.0) * (radius[s] + view.beside[b / 2] * point[2] / view.camera->fx);
            const double at[3] = {point[0] + offset * lateral[0], point[1] + offset * lateral[1], point[2] + offset * lateral[2]};
            add_height(view, at, heights);
        }
        if (heights.empty() || !(std::fabs(median(heights)) < view.near_radii * radius[s])) continue;
        const double rise = std::min((radius[s] - low) / slope, (1 + view.sunk_radii) * radius[s]);
        for (Index d = 0; d < 3; ++d) target[3 * s + d] -= rise * away[d];
    }
}
