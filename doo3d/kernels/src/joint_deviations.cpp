#include "arrays.h"

namespace {

constexpr Index TERMS = 8;
constexpr double MAX_OFFSET_RADII = 1.0;  // of a segment's readings, that counts at most, and where it is unknown

// Chains, what is known of their joints and segments, and the numbers of the frame.
struct Chains {
    const Matrix<double>& joints;
    const Vector<double>&radii, &share, &residual, &offset;
    const Vector<bool>& occluded;
    double pitch, pitch_per_m, noise, max_residual;  // m, m per m, 1/m, radii

    double length(Index first) const { return std::sqrt(squared_distance(row(first), row(first + 1), 3)); }
    const double* row(Index j) const { return joints.data() + 3 * j; }
};

double within(double value, double limit) { return value < limit ? value : limit; }  // the limit for NaN

// Return for the joints [first, last] how many segments the nearest one beside a seen segment is away; all of them if none is seen.
std::vector<double> steps_to_seen(const Chains& chains, Index first, Index last, Index segment) {
    const Index count = last - first;
    std::vector<double> steps(count + 1, double(count));
    for (Index k = 0; k < count; ++k) {
        if (!chains.occluded(segment + k)) steps[k] = steps[k + 1] = 0.0;
    }
    const double *start = chains.row(first), *end = chains.row(last);
    const bool is_ring = squared_distance(start, end, 3) == 0.0;
    for (Index turn = 0; turn < (is_ring ? 2 : 1); ++turn) {
        for (Index k = 1; k <= count; ++k) steps[k] = least(steps[k], steps[k - 1] + 1);
        for (Index k = count; k > 0; --k) steps[k - 1] = least(steps[k - 1], steps[k] + 1);
        if (is_ring) steps[0] = steps[count] = least(steps[0], steps[count]);
    }
    return steps;
}

// Return the root mean squares over a chain: of the radii about its radius, and of the offsets of its segments that have one.
std::pair<double, double> spreads(const Chains& chains, Index first, Index last, Index segment, double radius) {
    double width = 0.0, depth = 0.0, known = 0.0;
    for (Index j = first; j <= last; ++j) {
        const double off = chains.radii(j) - radius;
        if (std::isfinite(off)) width += off * off;
    }
    if (chains.offset.shape(0) == 0) return {std::sqrt(width / double(last - first + 1)), 0.0};
    for (Index s = segment; s < segment + last - first; ++s) {
        if (std::isnan(chains.offset(s))) continue;
        const double off = within(std::fabs(chains.offset(s)), MAX_OFFSET_RADII);
        depth += off * off;
        known += 1.0;
    }
    return {std::sqrt(width / double(last - first + 1)), radius * (known > 0 ? std::sqrt(depth / known) : MAX_OFFSET_RADII)};
}

// Write the squared terms of the joints [first, last] of a chain, TERMS each.
void add_terms(const Chains& chains, Index first, Index last, Index segment, double radius, double* terms) {
    if (!std::isfinite(radius)) radius = 0.0;
    const auto [rough, spread] = spreads(chains, first, last, segment, radius);
    const std::vector<double> steps = steps_to_seen(chains, first, last, segment);
    const double length = chains.length(first);
    for (Index j = first; j <= last; ++j, terms += TERMS) {
        const Index before = segment + most<Index>(j - first - 1, 0), after = segment + least(j, last - 1) - first;
        const double z = chains.row(j)[2], bulge = chains.radii(j) - radius;
        double unsupported = 0.0, residual = 0.0;
        if (chains.share.shape(0)) {
            unsupported = 1 - (chains.share(before) + chains.share(after)) / 2;
            residual = most(within(chains.residual(before), chains.max_residual), within(chains.residual(after), chains.max_residual));
        }
        const double pitch = chains.pitch + chains.pitch_per_m * z, noise = chains.noise * z * z;
        const double values[TERMS] = {pitch, noise, radius * unsupported, radius * residual, spread,
                                      std::isfinite(bulge) ? bulge : 0.0, rough, length * steps[j - first]};
        for (Index t = 0; t < TERMS; ++t) terms[t] = values[t] * values[t];
    }
}

auto joint_deviations(Matrix<double> joints, Vector<Index> bounds, Vector<double> radius, Vector<double> radii, Vector<bool> occluded,
                      Vector<double> share, Vector<double> residual, Vector<double> offset, Matrix<double> weights,
                      double pitch, double pitch_per_m, double noise, double max_residual) {
    check_bounds(bounds, joints.shape(0));
    const std::size_t chains = radius.shape(0), count = joints.shape(0), columns = weights.shape(1);
    require(joints.shape(1) == 3 && weights.shape(0) == TERMS, "joints and weights are not (J, 3) and (8, M)");
    require(chains + 1 == bounds.shape(0) && radii.shape(0) == count, "radius is not one per chain, or radii not one per joint");
    for (std::size_t c = 0; c < chains; ++c) require(bounds(c + 1) - bounds(c) > 1, "a chain has no segment");
    require(occluded.shape(0) + chains == count, "occluded is not one per segment");
    for (const auto* each : {&share, &residual, &offset}) {
        require(each->shape(0) == share.shape(0) && (each->shape(0) == 0 || each->shape(0) == occluded.shape(0)),
                "share, residual and offset are not one per segment, or none");
    }
    count_visits(Index(count));
    ReleasedGil released;
    const Chains all{joints, radii, share, residual, offset, occluded, pitch, pitch_per_m, noise, max_residual};
    std::vector<double> terms(count * TERMS), result(count * columns, 0.0);
    for (std::size_t c = 0; c < chains; ++c) {
        add_terms(all, bounds(c), bounds(c + 1) - 1, bounds(c) - Index(c), radius(c), terms.data() + bounds(c) * TERMS);
    }
    for (std::size_t j = 0; j < count; ++j) {
        for (std::size_t m = 0; m < columns; ++m) {
            double sum = 0.0;
            for (Index t = 0; t < TERMS; ++t) sum += weights(t, m) * weights(t, m) * terms[j * TERMS + t];
            result[j * columns + m] = std::sqrt(sum);
        }
    }
    released.end();
    return to_numpy(std::move(result), count, columns);
}

}  // namespace

void bind_joint_deviations(Module& m) {
    // Return standard deviations of the joints of chains, roots of weighted sums of squared terms.
    //
    // The eight terms are pitch, noise, unsupported, residual, spread, bulge, roughness and hidden, in this order.
    //
    // Parameters
    // ----------
    // joints
    //     (J, 3) float64 m, the joints of C chains, one chain after the other
    // bounds
    //     (C + 1,) int64; the joints of chain c are joints[bounds[c]:bounds[c + 1]], two at least; the last entry is J
    // radius, radii
    //     (C,) and (J,) float64 m, radius of each chain and at each joint; NaN if unknown. Terms: by how much the one at the
    //     joint differs from the chain's (bulge); the root mean square of these (roughness)
    // occluded
    //     (S,) bool of S segments. Term: length of chain from a joint to the nearest one beside a seen segment (hidden), of the
    //     whole chain if none is seen
    // share, residual, offset
    //     (S,) float64, as of `depth_support`; (0,) without depth. Terms, each times the radius: 1 less the mean share of the two
    //     segments at a joint (unsupported), the greater residual of these, and the root mean square of the chain's offsets (spread)
    // weights
    //     (8, M) float64, of the terms in M kinds of deviation
    // pitch, pitch_per_m, noise
    //     pitch, m, and what a m of depth adds to it; standard deviation of inverse depth, 1/m, which times squared depth is the noise
    // max_residual
    //     radii, the residual that counts at most, which stands for unknown ones
    //
    // Returns
    // -------
    // (J, M) float64 m.
    m.def("joint_deviations", &joint_deviations, "joints"_a.noconvert(), "bounds"_a.noconvert(), "radius"_a.noconvert(),
          "radii"_a.noconvert(), "occluded"_a.noconvert(), "share"_a.noconvert(), "residual"_a.noconvert(), "offset"_a.noconvert(),
          "weights"_a.noconvert(), nb::kw_only(), "pitch"_a, "pitch_per_m"_a, "noise"_a, "max_residual"_a);
}
