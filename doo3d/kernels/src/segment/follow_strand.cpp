#include "image.h"

namespace {

using Color = std::array<double, 3>;

struct Position {
    double u, v;
};

// Radii from the middle, across a strand, at which its colors are read, and those of the background on both sides, clear of soft edges.
constexpr double ACROSS_RADII[] = {-0.7, -0.35, 0.0, 0.35, 0.7}, BESIDE_RADII[] = {-2.2, -1.7, 1.7, 2.2};
// Turns tried at a step, in halves of its length in radii: no object bends more sharply than two of its radii. Lateral shifts, px.
constexpr double TURNS[] = {-1.0, -2.0 / 3, -1.0 / 3, 0.0, 1.0 / 3, 2.0 / 3, 1.0}, SHIFTS_PX[] = {-1.0, 0.0, 1.0};
constexpr Index TRIED_TURNS = 7, TRIED_SHIFTS = 3, WAYS = TRIED_TURNS * TRIED_SHIFTS;
// Steps ahead that a step is judged by: the mean over them.
constexpr Index LOOKAHEAD = 4;
// Radii before the end of a chain over which the colors of its strand, and its direction, are measured.
constexpr double PROFILE_LENGTH_RADII = 10.0, DIRECTION_LENGTH_RADII = 4.0;
// Radii of the strand that may look different: another strand on top, a print, a glare.
constexpr double MAX_HIDDEN_RADII = 8.0;
// Squared color distance of the strand ahead from the strand so far, at most, in variances of the latter, and by how much that of the
// background on either side exceeds it at least.
constexpr double MAX_DISTANCE = 2.5, MIN_CONTRAST = 1.5;
// Weights, per squared color distance, that choose among turns and shifts whose colors all fit: contrast up to the one that is always
// enough is good, the largest turn is bad.
constexpr double CONTRAST_WEIGHT = 0.5, TURN_WEIGHT = 0.36;

class Follower {
   public:
    Follower(const Volume<Byte>& image, const Matrix<bool>& mask, double radius, double step, double noise)
        : image(image), mask(mask), radius(radius), step(step), noise(noise), height(image.shape(0)), width(image.shape(1)) {}

    std::vector<double> follow(const Matrix<double>& joints, double max_length, double min_extension) {
        start(joints);
        const double adaptation = step / PROFILE_LENGTH_RADII;  // the colors of a strand are those of so many radii behind
        std::vector<double> path{at.u, at.v};
        const Index hidden = Index(MAX_HIDDEN_RADII / step);
        for (double length = 0.0; length < max_length * radius;) {
            if (!find_step(1, 1) && !find_step(2, hidden)) break;  // where the strand is hidden, all positions beyond are tried
            for (std::size_t i = 0; i < colors.size(); ++i) {
                for (Index c = 0; c < 3; ++c) colors[i][c] = colors[i][c] + adaptation * (taken.colors[i][c] - colors[i][c]);
            }
            at = taken.position, angle = angle + taken.turn, length += taken.length;
            path.insert(path.end(), {at.u, at.v});
            if (!(at.u >= 0 && at.v >= 0 && at.u <= double(width - 1) && at.v <= double(height - 1))) break;
            const Index pixel = Index(std::nearbyint(at.v)) * width + Index(std::nearbyint(at.u));
            if (length > min_extension * radius && bytes_of(mask)[pixel]) break;
        }
        return path;
    }

   private:
    // What is seen at a distance ahead: the position, and the distance of the colors across it from those so far. The contrast of the
    // background on either side is measured where it decides.
    struct Sight {
        Position position;
        double distance;
        std::array<double, 2> contrast;
        bool has_contrast;
    };
    struct Direction {
        Position forward, lateral;
    };
    struct Step {
        Position position;
        double turn, length;
        std::vector<Color> colors;
    };

    const Volume<Byte>& image;
    const Matrix<bool>& mask;
    double radius, step, noise;  // px, radii, grey levels
    Index height, width;
    Position at{};
    double angle = 0.0;
    std::vector<Color> colors;  // across the strand so far
    Color variance{};           // along it
    Step taken;

    // Return the color of the pixel nearest to a position, blurred by the weights 1, 2, 1 along rows and columns.
    Color read(double u, double v) const {
        const Index x = Index(std::clamp(std::nearbyint(u), 0.0, double(width - 1)));
        const Index y = Index(std::clamp(std::nearbyint(v), 0.0, double(height - 1)));
        std::array<int, 3> sum{};
        for (Index dy = -1; dy <= 1; ++dy) {
            const Byte* row = image.data() + 3 * mirrored(y + dy, height) * width;
            for (Index dx = -1; dx <= 1; ++dx) {
                const Byte* pixel = row + 3 * mirrored(x + dx, width);
                for (Index c = 0; c < 3; ++c) sum[c] += (2 - std::abs(int(dy))) * (2 - std::abs(int(dx))) * pixel[c];
            }
        }
        return {double((sum[0] + 8) >> 4), double((sum[1] + 8) >> 4), double((sum[2] + 8) >> 4)};
    }

    Color read(const Position& p, const Position& lateral, double radii) const {
        return read(p.u + lateral.u * radius * radii, p.v + lateral.v * radius * radii);
    }

    // Take position, direction, colors and their variance from the last joints of a chain.
    void start(const Matrix<double>& joints) {
        const auto joint = [&](Index i) { return Position{joints.data()[2 * i], joints.data()[2 * i + 1]}; };
        const Index last = Index(joints.shape(0)) - 1;
        const auto segment = [&](Index i) { return Position{joint(i + 1).u - joint(i).u, joint(i + 1).v - joint(i).v}; };
        const auto length = [](const Position& p) { return std::sqrt(p.u * p.u + p.v * p.v); };
        const auto first = [&](double radii) {
            const double count = std::ceil(radii * radius / length(segment(last - 1)));
            return last - Index(std::clamp(count, 1.0, double(last)));
        };
        const Index begin = first(PROFILE_LENGTH_RADII), from = std::max(begin, first(DIRECTION_LENGTH_RADII));
        at = joint(last);
        angle = std::atan2(at.v - joint(from).v, at.u - joint(from).u);
        const double size = length(segment(begin));
        if (!(size > 0)) throw std::invalid_argument("two joints lie at the same place");
        const double end = std::max(double(last - begin) * size - radius, 1.0);  // the mask may end slantwise in the last radius
        std::vector<std::vector<Color>> rows;
        for (Index k = 0; double(k) < end; ++k) {
            const Index index = std::min(Index(double(k) / size), last - begin - 1);
            const Position forward{segment(begin + index).u / size, segment(begin + index).v / size}, lateral{-forward.v, forward.u};
            const double beyond = double(k) - double(index) * size;
            const Position middle{joint(begin + index).u + forward.u * beyond, joint(begin + index).v + forward.v * beyond};
            rows.emplace_back();
            for (const double across : ACROSS_RADII) rows.back().push_back(read(middle, lateral, across));
        }
        measure(rows);
    }

    // Set the mean colors across the strand, and the mean of their variances along it.
    void measure(const std::vector<std::vector<Color>>& rows) {
        const double count = double(rows.size()), size = double(std::size(ACROSS_RADII));
        colors.assign(std::size(ACROSS_RADII), Color{});
        variance = Color{};
        for (Index c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < colors.size(); ++i) {
                double sum = 0.0, squares = 0.0;
                for (const auto& row : rows) sum += row[i][c];
                colors[i][c] = sum / count;
                for (const auto& row : rows) squares += (row[i][c] - colors[i][c]) * (row[i][c] - colors[i][c]);
                variance[c] += squares / count;
            }
            variance[c] = variance[c] / size + noise * noise;
        }
    }

    // Return the mean squared difference of two colors, in variances.
    double distance(const Color& one, const Color& other) const {
        double sum = 0.0;
        for (Index c = 0; c < 3; ++c) sum += (one[c] - other[c]) * (one[c] - other[c]) / variance[c];
        return sum / 3;
    }

    std::vector<Color> colors_across(const Position& position, const Position& lateral) const {
        std::vector<Color> found;
        for (const double across : ACROSS_RADII) found.push_back(read(position, lateral, across));
        return found;
    }

    double turn_of(Index way) const { return TURNS[way / TRIED_SHIFTS] * step / 2; }

    Sight look(const Direction& direction, double ahead, double shift) const {
        const auto& [forward, lateral] = direction;
        count_visits(9 * Index(colors.size()));
        const Position position{at.u + forward.u * ahead + lateral.u * shift, at.v + forward.v * ahead + lateral.v * shift};
        double sum = 0.0;
        for (std::size_t i = 0; i < colors.size(); ++i) sum += distance(read(position, lateral, ACROSS_RADII[i]), colors[i]);
        return {position, sum / double(colors.size()), {0.0, 0.0}, false};
    }

    // Measure the contrast of the background with the strand so far, unless it is known.
    void measure_contrast(Sight& sight, const Position& lateral) const {
        if (sight.has_contrast) return;
        sight.has_contrast = true;
        count_visits(9 * Index(std::size(BESIDE_RADII)));
        const std::size_t half = std::size(BESIDE_RADII) / 2;
        for (std::size_t k = 0; k < 2 * half; ++k) {
            const Color background = read(sight.position, lateral, BESIDE_RADII[k]);
            double least = INFINITY;
            for (const Color& own : colors) least = std::min(least, distance(background, own));
            sight.contrast[k / half] += least;
        }
        for (double& side : sight.contrast) side /= double(half);
    }

    // Return the mean distance of the colors at the `lookahead` positions from `first` on.
    double mean_distance(const std::vector<Sight>& seen, Index first) const {
        double sum = 0.0;
        for (Index j = first; j < first + LOOKAHEAD; ++j) sum += seen[j].distance;
        return sum / double(LOOKAHEAD);
    }

    // Return the lesser of the mean contrasts on both sides of the `lookahead` positions from `first` on.
    double least_contrast(std::vector<Sight>& seen, Index first, const Position& lateral) const {
        std::array<double, 2> sides{};
        for (Index j = first; j < first + LOOKAHEAD; ++j) {
            measure_contrast(seen[j], lateral);
            for (Index side = 0; side < 2; ++side) sides[side] += seen[j].contrast[side];
        }
        return std::min(sides[0] / double(LOOKAHEAD), sides[1] / double(LOOKAHEAD));
    }

    // Find the nearest of `count` steps from the `first` on at which the strand is seen, in the best direction. Where the colors fit in
    // no direction, the background is not looked at.
    bool find_step(Index first, Index count) {
        std::vector<std::vector<Sight>> seen(WAYS);
        std::vector<Direction> directions;
        for (Index way = 0; way < WAYS; ++way) {
            const double heading = angle + turn_of(way);
            const Position forward{std::cos(heading), std::sin(heading)};
            directions.push_back({forward, {-forward.v, forward.u}});
        }
        const auto ahead = [&](Index k) { return step * radius * double(first + k); };
        for (Index k = 0; k < count; ++k) {
            bool fits = false;
            for (Index way = 0; way < WAYS; ++way) {
                while (Index(seen[way].size()) < k + LOOKAHEAD) {
                    seen[way].push_back(look(directions[way], ahead(Index(seen[way].size())), SHIFTS_PX[way % TRIED_SHIFTS]));
                }
                fits |= mean_distance(seen[way], k) <= MAX_DISTANCE;
            }
            if (!fits) continue;
            double best_cost = INFINITY, best_distance = 0.0, best_contrast = 0.0;
            Index best = 0;
            for (Index way = 0; way < WAYS; ++way) {
                const double distance = mean_distance(seen[way], k);
                const double contrast = least_contrast(seen[way], k, directions[way].lateral);
                const double share = TURNS[way / TRIED_SHIFTS];
                double cost = distance - CONTRAST_WEIGHT * std::min(contrast, MAX_DISTANCE + MIN_CONTRAST);
                cost += TURN_WEIGHT * (share * share);
                if (cost < best_cost) best_cost = cost, best_distance = distance, best_contrast = contrast, best = way;
            }
            if (best_distance <= MAX_DISTANCE && best_contrast >= best_distance + MIN_CONTRAST) {
                const Position& position = seen[best][k].position;
                taken = {position, turn_of(best), ahead(k), colors_across(position, directions[best].lateral)};
                return true;
            }
        }
        return false;
    }
};

auto follow_strand(Volume<Byte> image, Matrix<bool> mask, Matrix<double> joints, double radius, double max_length, double step,
                   double min_extension, double noise) {
    require(image.shape(2) == 3 && image.shape(0) == mask.shape(0) && image.shape(1) == mask.shape(1), "image and mask do not fit");
    require(image.shape(0) > 0 && image.shape(1) > 0, "the image is empty");
    require(joints.shape(0) > 1 && joints.shape(1) == 2, "joints has to be (N, 2) with two joints at least");
    require(radius > 0 && std::isfinite(max_length * radius), "the radius is not positive, or the length not finite");
    require(step >= 0.01, "a step is less than 0.01 radii");
    for (std::size_t i = 0; i < 2 * joints.shape(0); ++i) require(std::abs(joints.data()[i]) < 1e6, "a joint is not finite, or too far away");
    std::vector<double> path = Follower(image, mask, radius, step, noise).follow(joints, max_length, min_extension);
    return rows_of(std::move(path), 2);
}

}  // namespace

void bind_follow_strand(Module& m) {
    // Follow a strand in an image beyond the last joint of its chain, by the colors across the strand.
    //
    // A stretch that looks different, such as another strand on top, is skipped. The path ends where it runs into the mask, at the
    // border of the image, after `max_length` radii, or where the colors no longer match. Colors are those of the nearest pixels,
    // blurred by the weights 1, 2, 1 along rows and columns; only pixels that are asked for are blurred.
    //
    // Parameters
    // ----------
    // image
    //     (H, W, 3) uint8 RGB
    // mask
    //     (H, W) bool, the pixels already known to be of the object
    // joints
    //     (N, 2) px (u, v), N >= 2, the joints of the chain, in C order; the strand is followed beyond the last one
    // radius, max_length
    //     px, radius of the strand; radii, length of the path at most
    // step, min_extension
    //     radii of a step, 0.01 or more, and after which a path ends in the mask
    // noise
    //     grey levels by which the colors of one strand differ anyway
    //
    // Returns
    // -------
    // (P, 2) px, P points along the strand, beginning with the last joint; P = 1 if the strand does not continue
    //
    // Raises
    // ------
    // ValueError : shapes do not fit, a joint is not finite or two lie at the same place, or the radius is not positive.
    m.def("follow_strand", &follow_strand, "image"_array, "mask"_array, "joints"_array, "radius"_a, "max_length"_a, nb::kw_only(), "step"_a,
          "min_extension"_a, "noise"_a);
}
