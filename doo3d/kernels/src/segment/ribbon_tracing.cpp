#include "image.h"

namespace {

constexpr Index LOOKAHEAD = 3, SAMPLE = 5;  // steps whose mean decides; numbers of a sample: x, y, angle, width, score

// Turns per step that are tried, in degrees: a strand bends with a radius of 16 px at least. px sideways that are tried at each step.
constexpr double TURNS_DEGREES[] = {-7.0, -4.5, -2.0, 0.0, 2.0, 4.5, 7.0}, SHIFTS_PX[] = {-1.0, 0.0, 1.0};
// Cost of a px sideways, and of a change of the turn by the largest turn, in units of the score.
constexpr double SHIFT_COST = 0.15, TURN_CHANGE_COST = 0.6;
// Share that the strand's color, a running mean, keeps at a step.
constexpr double COLOR_MEMORY = 0.93;
// Logarithm of the ratio of variances below which no strand is seen.
constexpr double MIN_SCORE = 0.9;
// Widths plus px that a strand is carried on unseen, below another one or in a highlight.
constexpr double MAX_GAP_WIDTHS = 4.0, MAX_GAP_PX = 8.0;
// Samples on an earlier strand after which one ends; samples in one direction at most.
constexpr std::size_t MAX_SHARED_SAMPLES = 8, MAX_SAMPLES = 2000;

// What `ribbons.py` uses, too; `follow_ribbon` says what it is.
struct Limits {
    double step, color_scale, max_color_cost, color_cost, max_score, same_turn;
};

// Return the angle between two directions, up to a right angle.
double between(double first, double second) {
    double rest = std::fmod(first - second + PI / 2, PI);
    if (rest < 0) rest += PI;
    return std::fabs(rest - PI / 2);
}

class Follower {
   public:
    Follower(const Volume<float>& score, const Volume<Byte>& width, const Volume<float>& color, const Vector<double>& widths,
             const Limits& limits)
        : score(score), width(width), color(color), widths(widths), limits(limits), directions(score.shape(0)),
          height(score.shape(1)), columns(score.shape(2)) {}

    // Return the samples of a strand from a start in one direction, one after the other.
    std::vector<double> operator()(double x, double y, double angle, const Matrix<Byte>& taken, const Matrix<float>& angles) const {
        std::vector<double> samples;
        double turn = 0.0, gap = 0.0;
        std::size_t shared = 0;
        const Index start = Index(std::nearbyint(y)) * columns + Index(std::nearbyint(x));
        double wide = width_at(angle, start);
        float own[CHANNELS];
        std::copy_n(color.data() + start * CHANNELS, CHANNELS, own);
        while (samples.size() < MAX_SAMPLES * SAMPLE) {
            const Step step = best_step(x, y, angle, turn, own);
            if (step.seen) {
                turn = step.turn;
                angle = step.angle;
                x = step.x;
                y = step.y;
                gap = 0.0;
                wide = 0.8 * wide + 0.2 * width_at(angle, step.pixel);
                const float memory = float(COLOR_MEMORY), rest = float(1 - COLOR_MEMORY);
                for (Index k = 0; k < CHANNELS; ++k) own[k] = memory * own[k] + rest * color.data()[step.pixel * CHANNELS + k];
            } else {
                angle = angle + turn / 2;
                turn = 0.8 * turn;
                gap += limits.step;
                x += limits.step * std::cos(angle);
                y += limits.step * std::sin(angle);
            }
            const Index at = pixel_at(x, y, height, columns);
            if (at < 0) break;
            const bool follows = taken.data()[at] && between(angle, angles.data()[at]) < limits.same_turn;
            shared = follows ? shared + 1 : 0;
            samples.insert(samples.end(), {x, y, angle, wide, step.seen ? double(step.score) : NAN});
            if (shared > MAX_SHARED_SAMPLES) {
                samples.resize(samples.size() - MAX_SHARED_SAMPLES * SAMPLE);
                break;
            }
            if (gap > MAX_GAP_WIDTHS * wide + MAX_GAP_PX) break;
        }
        while (!samples.empty() && std::isnan(samples.back())) samples.resize(samples.size() - SAMPLE);
        return samples;
    }

   private:
    struct Step {
        bool seen;
        double x, y, angle, turn;
        float score;
        Index pixel;
    };
    const Volume<float>& score;
    const Volume<Byte>& width;
    const Volume<float>& color;
    const Vector<double>& widths;
    Limits limits;
    Index directions, height, columns;

    Index direction(double angle) const {
        const Index at = Index(std::nearbyint(angle / PI * double(directions))) % directions;
        return at < 0 ? at + directions : at;
    }
    double width_at(double angle, Index pixel) const { 
        return widths(std::min<std::size_t>(width.data()[direction(angle) * height * columns + pixel], widths.shape(0) - 1));
    }

    float value_at(double u, double v, Index direction, const float* own, Index& pixel) const {
        const double column = std::clamp(std::nearbyint(u), 0.0, double(columns - 1)), row = std::clamp(std::nearbyint(v), 0.0, double(height - 1));
        pixel = Index(row) * columns + Index(column);
        if (pixel_at(u, v, height, columns) < 0) return -1.0f;
        float square = 0.0f;
        for (Index k = 0; k < CHANNELS; ++k) {
            const float away = color.data()[pixel * CHANNELS + k] - own[k];
            square += away * away;
        }
        const float scaled = square / float(limits.color_scale * limits.color_scale);
        const float cost = float(limits.color_cost) * std::min(scaled, float(limits.max_color_cost));
        return std::min(score.data()[direction * height * columns + pixel], float(limits.max_score)) - cost;
    }

    // Return the turn and the shift sideways with the best mean over the next steps, less their costs.
    Step best_step(double x, double y, double angle, double turn, const float* own) const {
        Step best{false, x, y, angle, turn, 0.0f, 0};
        const double sideways_u = std::sin(angle), sideways_v = std::cos(angle);
        const double largest = TURNS_DEGREES[std::size(TURNS_DEGREES) - 1] * (PI / 180);
        double highest = -INFINITY;
        for (const double degrees : TURNS_DEGREES) {
            const double turned = degrees * (PI / 180);
            double along_u[LOOKAHEAD], along_v[LOOKAHEAD], u = 0, v = 0;
            Index headed[LOOKAHEAD];
            for (Index k = 0; k < LOOKAHEAD; ++k) {
                const double heading = angle + turned * double(k + 1);
                along_u[k] = u += limits.step * std::cos(heading);
                along_v[k] = v += limits.step * std::sin(heading);
                headed[k] = direction(heading);
            }
            for (const double shift : SHIFTS_PX) {
                float values[LOOKAHEAD];
                Index pixels[LOOKAHEAD];
                for (Index k = 0; k < LOOKAHEAD; ++k) {
                    values[k] = value_at(x + along_u[k] - shift * sideways_u, y + along_v[k] + shift * sideways_v, headed[k], own, pixels[k]);
                }
                const float mean = (values[0] + values[1] + values[2]) / float(LOOKAHEAD);
                const double turning = TURN_CHANGE_COST * std::fabs(turned - turn) / largest;
                const double rank = double(mean) - (SHIFT_COST * std::fabs(shift) + turning);
                if (!(rank > highest)) continue;
                highest = rank;
                best = {values[0] > float(MIN_SCORE) && mean > float(MIN_SCORE),
                        x + along_u[0] - shift * sideways_u,
                        y + along_v[0] + shift * sideways_v,
                        angle + turned,
                        turned,
                        values[0],
                        pixels[0]};
            }
        }
        return best;
    }
};

auto follow_ribbon(Volume<float> score, Volume<Byte> width, Volume<float> color, Matrix<Byte> taken, Matrix<float> angles,
                   Vector<double> start, Vector<double> widths, double step, double color_scale, double max_color_cost, double color_cost,
                   double max_score, double same_turn) {
    const Index height = score.shape(1), columns = score.shape(2);
    const auto is_image = [&](Index rows, Index across) { return rows == height && across == columns; };
    require(score.shape(0) > 0 && width.shape(0) == score.shape(0) && is_image(width.shape(1), width.shape(2)), "score and width differ");
    require(is_image(color.shape(0), color.shape(1)) && color.shape(2) == CHANNELS, "color is not (H, W, 3)");
    require(is_image(taken.shape(0), taken.shape(1)) && is_image(angles.shape(0), angles.shape(1)), "taken or angles are not (H, W)");
    require(start.shape(0) == 3 && std::isfinite(start(2)), "start is not (3,) and finite");
    require(widths.shape(0) > 0, "there are no widths");
    require(start(0) >= 0 && start(1) >= 0 && start(0) <= double(columns - 1) && start(1) <= double(height - 1), "start is not in the image");
    const Limits limits{step, color_scale, max_color_cost, color_cost, max_score, same_turn};
    count_visits(Index(std::size(TURNS_DEGREES) * std::size(SHIFTS_PX)));
    std::vector<double> samples = Follower(score, width, color, widths, limits)(start(0), start(1), start(2), taken, angles);
    return rows_of(std::move(samples), SAMPLE);
}

}  // namespace

void bind_ribbon_tracing(Module& m) {
    // Follow a strand along the ribbons of an image from a start in one direction, not counting the start.
    //
    // Each step takes the turn and the shift sideways with the best mean over three steps of the score less the cost of the color,
    // less their own costs. Where the score is too low it goes straight on, up to a longest gap. The strand ends at the border,
    // after a gap, and where it follows an earlier strand.
    //
    // Parameters
    // ----------
    // score
    //     (D, H, W) float32, in D directions over half a turn.
    // width
    //     (D, H, W) uint8, the index in `widths` of the width with that score.
    // color
    //     (H, W, 3) float32, CIELAB.
    // taken, angles
    //     (H, W) uint8 and float32, non-zero on earlier strands, and their directions in radians.
    // start
    //     (3,) x and y in px, within the image, and the direction in radians from x to y.
    // widths
    //     (K,) px.
    // step
    //     px of a step.
    // color_scale, max_color_cost, color_cost
    //     difference of colors that costs `color_cost`, and times that its square costs at most.
    // max_score
    //     score beyond which more says nothing.
    // same_turn
    //     radians below which an earlier strand is followed.
    //
    // Returns
    // -------
    // (P, 5) x, y, direction, running mean of the width, and score less the cost of the color, NaN where the strand is not seen; the
    // last sample is seen.
    m.def("follow_ribbon", &follow_ribbon, "score"_array, "width"_array, "color"_array, "taken"_array, "angles"_array, "start"_array,
          "widths"_array, nb::kw_only(), "step"_a, "color_scale"_a, "max_color_cost"_a, "color_cost"_a, "max_score"_a, "same_turn"_a);
}
