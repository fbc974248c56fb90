// The strand among runs of readings, by dynamic programming.
//
// Where most of a strand reads the depth of what lies behind it, the median is behind it, too, and the strand's own readings lie in
// front of the curve, where nothing can be; where about half of it does, the curve lies between both, and its noise is as large as
// what lies behind is far. Then the strand is looked for among the runs of readings without jumps: by dynamic programming, a chain of
// runs is chosen that costs least. Going on in another run costs the square of the slope to it; the readings between two runs of the
// chain lie on the line between these, or off it, which costs per reading and per stretch: less where they are nearer to what is seen
// beside the strand, behind it (torn, as is usual), than to the line; more in front of it (the rim of an occluder: rare), and between
// it and what lies behind, where only the strand can be. The ends of the chain are level. Then the smoother starts from that chain.
//
#include "depth_runs.h"

namespace {

using Series = std::vector<double>;

// Costs of a reading of what lies behind a strand, of another one off the strand, and of a stretch of either, beside the square of the
// slope at which the strand goes on beyond them.
constexpr double BEHIND_COST = 0.3, UNUSUAL_COST = 0.8, STRETCH_COST = 5.0;

// A straight line that rises by `rise` a sample from a height at a sample; inside of a chain it lies between two runs.
struct Line {
    double at, rise;
    Index from;
    bool is_inside;
};

// The runs of readings without jumps along a strand, in the order of its samples.
struct Runs {
    const std::vector<Index>& known;  // samples with readings
    Series height;                    // inverse depth there, in radii
    Series surface;                   // that of what is seen beside the strand; infinite where it is not known
    double radius_px;
    std::vector<Index> start;  // first reading of each run, and one past the last

    Index count() const { return Index(start.size()) - 1; }
    Index last(Index run) const { return start[run + 1] - 1; }

    // Return the slope from one reading to another.
    double slope(Index from, Index to) const { return std::fabs(height[to] - height[from]) * radius_px / double(known[to] - known[from]); }

    // Return the cost of the readings `first` to before `end` that lie off a line, or `limit` if that is less.
    double off_line(const Line& on, Index first, Index end, double limit) const {
        double cost = 0;
        bool is_behind = false, is_unusual = false;
        Index k = first;
        for (; k < end && cost < limit; ++k) {
            const double line = on.at + on.rise * double(known[k] - on.from), off = height[k] - line;
            if (std::fabs(off) <= TORN_RADII) continue;
            if (off < 0 && 2 * height[k] < line + surface[k]) {
                cost += BEHIND_COST + (is_behind ? 0 : STRETCH_COST);
                is_behind = true;
            } else {
                const bool is_rim = off > 0 && !on.is_inside;  // at an end of the strand, of what it goes under
                cost += UNUSUAL_COST + (is_unusual || is_rim ? 0 : STRETCH_COST);
                is_unusual = is_unusual || !is_rim;
            }
        }
        count_visits(k - first + 1);
        return std::min(cost, limit);
    }
};

Runs runs_of(const Strand& strand, const std::vector<Index>& known, double per_radius, double max_slope) {
    Runs runs{known, chosen(strand.filled, known), chosen(strand.surface, known), strand.radius_px, {0}};
    for (Series* values : {&runs.height, &runs.surface}) {
        for (double& value : *values) value /= per_radius;
    }
    for (Index k = 1; k < Index(known.size()); ++k) {
        if (runs.slope(k - 1, k) > max_slope) runs.start.push_back(k);
    }
    runs.start.push_back(Index(known.size()));
    return runs;
}

// Runs back among which the one before a run is looked for: what hides a strand is one to ten runs wide. Noise in which every reading
// is a run of its own would take the cube of its length.
constexpr Index MAX_RUNS_BETWEEN = 128;

// The cheapest chains that end with each run.
class Chains {
public:
    explicit Chains(const Runs& runs) : runs_(runs), cost_(runs.count()), before_(runs.count(), -1) {
        const Index readings = Index(runs.known.size());
        for (Index run = 0; run < runs.count(); ++run) {
            const Index first = runs.start[run], last = runs.last(run);
            cost_[run] = runs.off_line({runs.height[first], 0, 0, false}, 0, first, least_);
            find_before(run);
            const double cost = cost_[run] + runs.off_line({runs.height[last], 0, 0, false}, last + 1, readings, least_);
            if (cost >= least_) continue;
            least_ = cost;
            best_ = run;
        }
    }

    // Return the samples with readings of the chain that costs least.
    std::vector<Index> samples() const {
        std::vector<Byte> is_in(runs_.count());
        for (Index run = best_; run >= 0; run = before_[run]) is_in[run] = 1;
        std::vector<Index> samples;
        for (Index run = 0; run < runs_.count(); ++run) {
            for (Index k = runs_.start[run]; is_in[run] && k < runs_.start[run + 1]; ++k) samples.push_back(runs_.known[k]);
        }
        return samples;
    }

private:
    // Find the run before a run, if a chain with one costs less.
    void find_before(Index run) {
        const Index first = runs_.start[run];
        for (Index other = run - 1; other >= std::max<Index>(0, run - MAX_RUNS_BETWEEN); --other) {
            const Index end = runs_.last(other), from = runs_.known[end];
            const double slope = runs_.slope(end, first), at = runs_.height[end];
            const double limit = cost_[run] - cost_[other] - slope * slope;
            if (limit <= 0) continue;
            const double rise = (runs_.height[first] - at) / double(runs_.known[first] - from);
            const double between = runs_.off_line({at, rise, from, true}, end + 1, first, limit);
            if (between >= limit) continue;
            cost_[run] = cost_[other] + slope * slope + between;
            before_[run] = other;
        }
    }

    const Runs& runs_;
    std::vector<double> cost_;
    std::vector<Index> before_;
    double least_ = INFINITY;
    Index best_ = 0;
};

}  // namespace

std::vector<Index> samples_of(const std::vector<Byte>& flags) {
    std::vector<Index> samples;
    for (Index i = 0; i < Index(flags.size()); ++i) {
        if (flags[i]) samples.push_back(i);
    }
    return samples;
}

Series chosen(const Series& values, const std::vector<Index>& samples) {
    Series some;
    for (const Index i : samples) some.push_back(values[i]);
    return some;
}

std::vector<Index> strand_samples(const Strand& strand, const std::vector<Index>& known, double per_radius, double max_slope) {
    const Runs runs = runs_of(strand, known, per_radius, max_slope);
    return Chains(runs).samples();
}
