// The depth of axes behind the surface points near them.
#include "axis_samples.h"
#include "order_statistics.h"

namespace {

// The depth noise of the axis in radii, as second differences so far apart that their pooled points are not the same tell it.
double depth_noise(const Samples& samples, const std::vector<double>& target, const AcrossAxes& axes, const std::vector<double>& weight) {
    const Index apart = 2 * samples.half + 1;
    std::vector<double> relative;
    const auto is_measured = [&](Index s) { return weight[s] > 0 && !samples.filled[s]; };
    for (Index first = 0; first + 2 * apart < samples.size(); ++first) {
        const Index middle = first + apart, last = middle + apart;
        if (samples.owner[first] != samples.owner[last]) continue;
        if (!is_measured(first) || !is_measured(middle) || !is_measured(last)) continue;
        double change[3];
        for (Index d = 0; d < 3; ++d) {
            change[d] = (target[3 * last + d] - 2 * target[3 * middle + d] + target[3 * first + d]) * axes.depth[3 * middle + d];
        }
        relative.push_back(std::fabs(change[0] + change[2] + change[1]) / samples.radius[middle]);
    }
    return MAD_TO_DEVIATION * finite_median(std::move(relative), 0.0) / std::sqrt(6.0);
}

// Average how far behind each position (S, 3) the axis lies over the surface points near it: behind a point with the offset u across
// the line of sight by sqrt(r^2 - u^2), where r is the radius.
PooledMeans depth_behind(const Samples& samples, const std::vector<double>& positions, const AcrossAxes& axes, const Seen& seen,
                         const Settings& settings) {
    double most = 0.0;
    for (const double radius : samples.radius) most = std::max(most, settings.touching_radii * radius);
    for (const double value : positions) require(std::isfinite(value), "a target is not finite");
    const Index count = seen.surface.shape(0);
    const double* surface = seen.surface.data();
    Index kept = 0;
    std::vector<double> behind(count);
    std::vector<Index> sample(count);
    const NearestOfPoints nearest(surface, count, positions.data(), samples.size(), 3, most);
    count_visits(count);
    for (Index n = 0; n < count; ++n) {
        const Index s = nearest.index[n];
        const double radius = samples.radius[s];
        if (!(nearest.distance[n] < settings.touching_radii * radius)) continue;
        const auto [u, w] = offsets_in_section(surface + 3 * n, &positions[3 * s], &axes.lateral[3 * s], &axes.depth[3 * s]);
        sample[kept] = s;
        behind[kept] = w + std::sqrt(radius * radius - u * u);
        kept += std::fabs(u) < settings.central_part * radius;  // without a branch: no processor foresees it
    }
    sample.resize(kept);
    behind.resize(kept);
    return means_without_outliers(std::move(sample), std::move(behind), samples.owner, samples.half, settings.deviations * MAD_TO_DEVIATION);
}

}  // namespace

void add_depth(const Samples& samples, const AcrossAxes& axes, const Seen& seen, const Settings& settings, Measured& measured) {
    const PooledMeans found = depth_behind(samples, measured.target, axes, seen, settings);
    std::vector<double> some, &weight = measured.depth_weight;
    for (const double number : found.count) {
        if (number > 0) some.push_back(number);
    }
    const double usual = finite_median(some, 1.0);
    for (Index s = 0; s < samples.size(); ++s) {
        weight[s] = found.count[s] > 0.1 * usual ? std::min(1.0, found.count[s] / usual) : 0.0;
        weight[s] *= (samples.filled[s] ? settings.gap_weight : 1.0) * settings.depth_weight;
        const double depth = weight[s] > 0 ? found.mean[s] : 0.0;
        for (Index d = 0; d < 3; ++d) measured.target[3 * s + d] += depth * axes.depth[3 * s + d];
    }
    const double noise = depth_noise(samples, measured.target, axes, weight);
    const double share = std::pow(std::min(1.0, settings.noise_radii / std::max(noise, 1e-9)), 2);
    for (double& each : weight) each *= share;
    if (!seen.plane) return;
    raise_to_plane({samples.size(), samples.positions.data(), axes.lateral.data(), axes.depth.data()}, samples.radius, *seen.plane,
                   measured.target);
}
