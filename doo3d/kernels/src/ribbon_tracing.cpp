#include "arrays.h"

#include <algorithm>
#include <limits>

namespace {

constexpr Index LOOKAHEAD = 3, SAMPLE = 5;  // steps whose mean decides; numbers of a sample: x, y, angle, width, score
const double PI = std::acos(-1.0);

struct Limits {
    double step, shift_cost, turn_change_cost, color_scale, max_color_cost, color_cost, color_memory, max_score, min_score, max_gap_widths,
        max_gap, same_turn, max_shared, max_samples;
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
             const Vector<double>& turns, const Vector<double>& shifts, const Limits& limits)
        : score(score), width(width), color(color), widths(widths), turns(turns), shifts(shifts), limits(limits),
          directions(score.shape(0)), height(score.shape(1)), columns(score.shape(2)) {}

    // Return the samples of a strand from a start in one direction, one after the other.
    std::vector<double> operator()(double x, double y, double angle, const Matrix<Byte>& taken, const Matrix<float>& angles) const {
        std::vector<double> samples;
        double turn = 0.0, gap = 0.0, shared = 0.0;
        const Index start = Index(std::nearbyint(y)) * columns + Index(std::nearbyint(x));
        double wide = width_at(angle, start);
        float own[CHANNELS];
        std::copy_n(color.data() + start * CHANNELS, CHANNELS, own);
        while (double(samples.size()) < limits.max_samples * SAMPLE) {
            const Step step = best_step(x, y, angle, turn, own);
            if (step.seen) {
                turn = step.turn;
                angle = step.angle;
                x = step.x;
                y = step.y;
                gap = 0.0;
                wide = 0.8 * wide + 0.2 * width_at(angle, step.pixel);
                const float memory = float(limits.color_memory), rest = float(1 - limits.color_memory);
                for (Index k = 0; k < CHANNELS; ++k) own[k] = memory * own[k] + rest * color.data()[step.pixel * CHANNELS + k];
            } else {
                angle = angle + turn / 2;
                turn = 0.8 * turn;
                gap += limits.step;
                x += limits.step * std::cos(angle);
                y += limits.step * std::sin(angle);
            }
            const double row = std::nearbyint(y), column = std::nearbyint(x);
            if (!(column >= 0 && column < double(columns) && row >= 0 && row < double(height))) break;
            const Index at = Index(row) * columns + Index(column);
            const bool follows = taken.data()[at] && between(angle, angles.data()[at]) < limits.same_turn;
            shared = follows ? shared + 1 : 0;
            samples.insert(samples.end(), {x, y, angle, wide, step.seen ? double(step.score) : std::numeric_limits<double>::quiet_NaN()});
            if (shared > limits.max_shared) {
                samples.resize(samples.size() - std::size_t(limits.max_shared) * SAMPLE);
                break;
            }
            if (gap > limits.max_gap_widths * wide + limits.max_gap) break;
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
    const Vector<double>&widths, &turns, &shifts;
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
        const double column = std::nearbyint(u), row = std::nearbyint(v);
        const bool inside = column >= 0 && row >= 0 && column < double(columns) && row < double(height);
        const double right = double(columns - 1), bottom = double(height - 1);
        pixel = Index(std::min(std::max(row, 0.0), bottom)) * columns + Index(std::min(std::max(column, 0.0), right));
        if (!inside) return -1.0f;
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
        const double sideways_u = std::sin(angle), sideways_v = std::cos(angle), largest = turns(turns.shape(0) - 1);
        double highest = -std::numeric_limits<double>::infinity();
        for (std::size_t t = 0; t < turns.shape(0); ++t) {
            double along_u[LOOKAHEAD], along_v[LOOKAHEAD], u = 0, v = 0;
            Index headed[LOOKAHEAD];
            for (Index k = 0; k < LOOKAHEAD; ++k) {
                const double heading = angle + turns(t) * double(k + 1);
                along_u[k] = u += limits.step * std::cos(heading);
                along_v[k] = v += limits.step * std::sin(heading);
                headed[k] = direction(heading);
            }
            for (std::size_t s = 0; s < shifts.shape(0); ++s) {
                float values[LOOKAHEAD];
                Index pixels[LOOKAHEAD];
                for (Index k = 0; k < LOOKAHEAD; ++k) {
                    values[k] = value_at(x + along_u[k] - shifts(s) * sideways_u, y + along_v[k] + shifts(s) * sideways_v, headed[k], own,
                                         pixels[k]);
                }
                const float mean = (values[0] + values[1] + values[2]) / float(LOOKAHEAD);
                const double turning = limits.turn_change_cost * std::fabs(turns(t) - turn) / largest;
                const double rank = double(mean) - (limits.shift_cost * std::fabs(shifts(s)) + turning);
                if (!(rank > highest)) continue;
                highest = rank;
                best = {values[0] > float(limits.min_score) && mean > float(limits.min_score),
                        x + along_u[0] - shifts(s) * sideways_u,
                        y + along_v[0] + shifts(s) * sideways_v,
                        angle + turns(t),
                        turns(t),
                        values[0],
                        pixels[0]};
            }
        }
        return best;
    }
};

auto follow_ribbon(Volume<float> score, Volume<Byte> width, Volume<float> color, Matrix<Byte> taken, Matrix<float> angles, Vector<double> start,
                   Vector<double> widths, Vector<double> turns, Vector<double> shifts, Vector<double> limits) {
    const Index height = score.shape(1), columns = score.shape(2);
    const auto is_image = [&](Index rows, Index across) { return rows == height && across == columns; };
    require(score.shape(0) > 0 && width.shape(0) == score.shape(0) && is_image(width.shape(1), width.shape(2)), "score and width differ");
    require(is_image(color.shape(0), color.shape(1)) && color.shape(2) == CHANNELS, "color is not (H, W, 3)");
    require(is_image(taken.shape(0), taken.shape(1)) && is_image(angles.shape(0), angles.shape(1)), "taken or angles are not (H, W)");
    require(start.shape(0) == 3 && std::isfinite(start(2)) && limits.shape(0) == 14, "start is not (3,) and finite, or limits not (14,)");
    require(limits(12) >= 0, "samples on an earlier strand are below 0");
    require(turns.shape(0) > 0 && shifts.shape(0) > 0 && widths.shape(0) > 0, "there are no turns, shifts or widths");
    require(start(0) >= 0 && start(1) >= 0 && start(0) <= double(columns - 1) && start(1) <= double(height - 1), "start is not in the image");
    const Limits values{limits(0), limits(1), limits(2), limits(3),  limits(4),  limits(5),  limits(6),
                        limits(7), limits(8), limits(9), limits(10), limits(11), limits(12), limits(13)};
    count_visits(Index(turns.shape(0) * shifts.shape(0)));
    std::vector<double> samples;
    {
        nb::gil_scoped_release released;
        samples = Follower(score, width, color, widths, turns, shifts, values)(start(0), start(1), start(2), taken, angles);
    }
    const std::size_t count = samples.size() / SAMPLE;
    return to_numpy(std::move(samples), count, SAMPLE);
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
    // turns, shifts
    //     radians and px that are tried at each step, the largest turn last.
    // limits
    //     (14,) px of a step; costs of a px sideways, and of a change of the turn by the largest turn; difference of colors that
    //     costs the next but one number, and times that it costs at most; that cost; share that the strand's color keeps at a step;
    //     highest and lowest score; widths and px of a gap at most; radians below which an earlier strand is followed; samples on
    //     one at most; samples at most.
    //
    // Returns
    // -------
    // (P, 5) x, y, direction, running mean of the width, and score less the cost of the color, NaN where the strand is not seen; the
    // last sample is seen.
    m.def("follow_ribbon", &follow_ribbon, "score"_a.noconvert(), "width"_a.noconvert(), "color"_a.noconvert(), "taken"_a.noconvert(),
          "angles"_a.noconvert(), "start"_a.noconvert(), "widths"_a.noconvert(), "turns"_a.noconvert(), "shifts"_a.noconvert(),
          "limits"_a.noconvert());
}
