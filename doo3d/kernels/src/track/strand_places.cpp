// Where the strands of a frame lie along an object whose shape is about known.
#include "polyline.h"

namespace {

constexpr Index BLOCK = 8;  // starts that are tried at once
constexpr double MAX_OVERLAP_SHARE = 0.2;  // of a strand that may overlap a strand placed earlier
// Cost, in squared standard deviations, of a strand that is placed: 3 of them. One that costs more has lost its depth, or joins parts that
// do not belong together, and would bend the object where it is hidden.
constexpr double MAX_COST = 9.0;

// The object: its samples, one array per coordinate, in which the first and the last one are repeated before and after.
struct Object {
    std::vector<double> coordinates[3];
    Index samples;
    double step, length, tolerance, overhang, shift_tolerances, most_of_tip;

    double most_starts() const { return (length + 2 * overhang) / step + 2; }
};

// A strand, and its place once it has one; backwards it starts at its last point.
struct Strand {
    const double *points, *sights;
    Index count;
    std::vector<double> arcs;
    double length, tips[2];
    double start = std::nan(""), cost = INFINITY;
    bool backwards = false;

    const double* end(bool last) const { return points + (last ? 3 * (count - 1) : 0); }
};

// The sums of the offsets of points from the samples at BLOCK successive starts, and of their squares, both across their sights.
struct Sums {
    double x[BLOCK], y[BLOCK], z[BLOCK], squares[BLOCK];
};

WITH_AVX2 Sums offsets(const Strand& strand, const std::vector<Index>& rows, const Object& object, Index start) {
    Sums sums{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const double *p = strand.points + 3 * i, *s = strand.sights + 3 * i;
        const Index at = start + rows[i];
        const double *x = &object.coordinates[0][at], *y = &object.coordinates[1][at], *z = &object.coordinates[2][at];
        UNROLLED
        for (Index b = 0; b < BLOCK; ++b) {
            const double to_x = p[0] - x[b], to_y = p[1] - y[b], to_z = p[2] - z[b];
            const double along = to_x * s[0] + to_y * s[1] + to_z * s[2];
            const double off_x = to_x - along * s[0], off_y = to_y - along * s[1], off_z = to_z - along * s[2];
            sums.x[b] += off_x;
            sums.y[b] += off_y;
            sums.z[b] += off_z;
            sums.squares[b] += off_x * off_x + off_y * off_y + off_z * off_z;
        }
    }
    return sums;
}

// Tells whether a strand lies on no strand placed before, and near enough to each for the object between them.
class Reach {
public:
    Reach(const Strand& strand, bool backwards, const std::vector<const Strand*>& placed, const Object& object)
        : length_(strand.length), margin_(MAX_OVERLAP_SHARE * strand.length) {
        const double slack = 3 * object.step + margin_ / 4;
        for (const Strand* other : placed) {
            const double after = std::sqrt(squared_distance(strand.end(backwards), other->end(!other->backwards), 3));
            const double before = std::sqrt(squared_distance(strand.end(!backwards), other->end(other->backwards), 3));
            others_.push_back({other->start, other->start + other->length, before - slack, after - slack});
        }
    }
    bool operator()(double start) const {
        for (const Other& other : others_) {
            const double after = start - other.high, before = other.low - (start + length_);
            if ((after <= -margin_ || after < other.after) && (before <= -margin_ || before < other.before)) return false;
        }
        return true;
    }

private:
    struct Other {
        double low, high, before, after;
    };
    double length_, margin_;
    std::vector<Other> others_;
};

// Find where a strand fits best in one direction, and place it there if it fits better than so far.
void search(Strand& strand, bool backwards, const std::vector<const Strand*>& placed, const Object& object) {
    const double first = -object.overhang, spacing = (first + object.step) - first;
    const double end = most(object.length - strand.length + object.overhang, first) + object.step;
    const Index starts = Index(std::ceil((end - first) / object.step)), points = Index(strand.arcs.size());
    std::vector<Index> rows(points);
    for (Index i = 0; i < points; ++i) {
        const double arc = backwards ? strand.length - strand.arcs[i] : strand.arcs[i], limit = double(object.samples);
        rows[i] = Index(std::min(std::max(std::nearbyint((first + arc) / object.step), -limit), limit)) + object.samples;
    }
    count_visits(starts * (points + Index(placed.size())));
    const Reach is_reachable(strand, backwards, placed, object);
    const double tip = object.overhang / 2, factor = object.shift_tolerances, number = double(points);
    const double most_shape = object.tolerance * object.tolerance, most_shift = factor * object.tolerance * factor * object.tolerance;
    for (Index block = 0; block < starts; block += BLOCK) {
        const Sums sums = offsets(strand, rows, object, block);
        for (Index b = 0; b < std::min(BLOCK, starts - block); ++b) {
            const double x = sums.x[b] / number, y = sums.y[b] / number, z = sums.z[b] / number;
            const double shift = x * x + y * y + z * z, shape = most(sums.squares[b] / number - shift, 0.0);
            if (!(shape <= most_shape && shift <= most_shift)) continue;
            const double start = first + double(block + b) * spacing;
            const double before = start / tip, after = (start + strand.length - object.length) / tip;
            const double cost = (shape + shift / (factor * factor)) / (object.overhang * object.overhang) +
                                strand.tips[backwards] * least(before * before, object.most_of_tip) +
                                strand.tips[!backwards] * least(after * after, object.most_of_tip);
            if (cost < strand.cost && is_reachable(start)) {
                strand.start = start;
                strand.cost = cost;
                strand.backwards = backwards;
            }
        }
    }
}

// Return the samples of an object, `steps` to a segment.
Object sampled(const StridedMatrix<double>& expected, double length, double tolerance, double steps, double overhang,
               double shift_tolerances, double max_tip_cost) {
    const Index segments = Index(expected.shape(0)) - 1;
    const double step = length / double(segments) / steps;
    Object object{{}, Index(std::nearbyint(length / step)) + 1, step, length, tolerance, overhang, shift_tolerances, max_tip_cost};
    const std::vector<double> joints = finite_points(expected), along = arc_lengths(joints, 3);
    const Index samples = object.samples, size = 3 * samples + Index(object.most_starts()) + BLOCK;
    for (std::vector<double>& values : object.coordinates) values.resize(size);
    count_visits(size);
    for (Index k = 0; k < samples; ++k) {
        const double at = k == samples - 1 ? along.back() : double(k) * (along.back() / double(samples - 1));
        double place[3];
        place_at([&](Index p, Index d) { return joints[3 * p + d]; }, along, at, 3, place);
        for (Index d = 0; d < 3; ++d) object.coordinates[d][samples + k] = place[d];
    }
    for (std::vector<double>& values : object.coordinates) {
        std::fill_n(values.begin(), samples, values[samples]);
        std::fill(values.begin() + 2 * samples, values.end(), values[2 * samples - 1]);
    }
    return object;
}

// Read a strand whose points are those from the row `first` on.
Strand strand_of(const double* points, const double* sights, const Vector<double>& arcs, Index first, Index end) {
    Strand strand{points + 3 * first, sights + 3 * first, end - first, {}, 0.0, {0.0, 0.0}};
    for (Index i = first; i < end; ++i) {
        require(std::isfinite(arcs(i)), "an arc length is not finite");
        strand.arcs.push_back(arcs(i));
    }
    return strand;
}

// Place strands, the longest first; one that costs too much has no place.
void place_all(std::vector<Strand>& strands, const Object& object) {
    std::vector<Strand*> order;
    for (Strand& strand : strands) order.push_back(&strand);
    std::stable_sort(order.begin(), order.end(), [](const Strand* a, const Strand* b) { return a->length > b->length; });
    std::vector<const Strand*> placed;
    for (Strand* strand : order) {
        if (strand->arcs.empty() || strand->length > object.length + 2 * object.overhang) continue;
        for (const bool backwards : {false, true}) search(*strand, backwards, placed, object);
        if (strand->cost < MAX_COST) {
            placed.push_back(strand);
        } else {
            strand->start = std::nan("");
        }
    }
}

auto strand_places(StridedMatrix<double> points, Vector<double> arcs, StridedMatrix<double> sights, Vector<Index> bounds,
                   Vector<double> lengths, Matrix<double> tips, StridedMatrix<double> expected, double length, double tolerance,
                   double steps, double length_error, double shift_tolerances, double max_tip_cost) {
    const Index count = points.shape(0), strands = lengths.shape(0);
    check_bounds(bounds, count);
    require(points.shape(1) == 3 && sights.shape(1) == 3 && expected.shape(1) == 3, "points do not have three coordinates");
    require(Index(arcs.shape(0)) == count && Index(sights.shape(0)) == count, "arcs or sights are not one per point");
    require(Index(bounds.shape(0)) == strands + 1 && Index(tips.shape(0)) == strands && tips.shape(1) == 2,
            "bounds, lengths and tips do not fit each other");
    require(expected.shape(0) >= 2 && std::isfinite(length) && length > 0, "the object has no length");
    require(steps >= 1 && steps <= 100 && length_error > 0 && length_error <= 1, "steps or the error of lengths are out of bounds");
    const Object object = sampled(expected, length, tolerance, steps, length_error * length, shift_tolerances, max_tip_cost);
    const std::vector<double> places = dense(points), directions = dense(sights);
    count_visits(count);
    std::vector<Strand> all;
    for (Index c = 0; c < strands; ++c) {
        require(std::isfinite(lengths(c)) && lengths(c) >= 0, "a length is not finite, or negative");
        all.push_back(strand_of(places.data(), directions.data(), arcs, bounds(c), bounds(c + 1)));
        all.back().length = lengths(c);
        for (Index side = 0; side < 2; ++side) all.back().tips[side] = tips(c, side);
    }
    place_all(all, object);
    std::vector<double> starts, costs;
    std::vector<Byte> backwards;
    for (const Strand& strand : all) {
        starts.push_back(strand.start);
        costs.push_back(strand.cost);
        backwards.push_back(strand.backwards);
    }
    return std::make_tuple(std::move(starts), std::move(costs), flags(std::move(backwards)));
}

}  // namespace

void bind_strand_places(Module& m) {
    // Return where the strands of a frame lie along an object whose shape is about known.
    //
    // Strands are placed in order of descending length, each where it costs least, in steps and in both directions. The cost is in
    // squared standard deviations, which are the error of lengths: the mean square of the offsets of the strand from the samples of
    // the object less that of their mean, plus the square of the mean in shares; and the squared distances of tips from the ends of
    // the object, in halves of the error.
    //
    // Parameters
    // ----------
    // points, bounds
    //     (N, 3) float64 m, the points of C strands one after the other, and (C + 1,) int64, the first of each, and N
    // arcs, sights
    //     (N,) float64 m, arc length from the start of its strand, and (N, 3) float64 unit, direction in which the place of the
    //     point is not known, along which its offset does not count; 0 where it is known
    // lengths, tips
    //     (C,) float64 m, and (C, 2) float64, weights of the ends of a strand as tips of the object
    // expected
    //     (J, 3) float64 m, J >= 2 joints of the object
    // length, tolerance
    //     m, of the object, and largest root mean square of the offsets less their mean
    // steps, length_error
    //     steps per segment; error of lengths, a share of the length
    // shift_tolerances, max_tip_cost
    //     shares of the mean offset, which may be as many tolerances; largest cost of a tip
    //
    // Returns
    // -------
    // starts : (C,) float64 m, arc length of the object at which the strand begins; NaN if it has no place
    // costs : (C,) float64
    // backwards : (C,) bool, True for a strand that begins with its last point
    m.def("strand_places", &strand_places, "points"_array, "arcs"_array, "sights"_array, "bounds"_array, "lengths"_array, "tips"_array,
          "expected"_array, "length"_a, "tolerance"_a, nb::kw_only(), "steps"_a, "length_error"_a, "shift_tolerances"_a, "max_tip_cost"_a);
}
