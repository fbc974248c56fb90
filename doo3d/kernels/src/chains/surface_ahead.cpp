#include "nearest.h"

namespace {

// Factor by which cells are looked up farther than needed, against rounding of coordinates far from the origin.
constexpr double MARGIN = 1.001;

// Square cells, along the first two axes, each with the ends whose boxes reach into it. A point is compared with the ends of its
// cell alone, so that the points need no order. The edge of the cells is doubled until their number is in proportion to the points.
class BoxesOfEnds {
public:
    BoxesOfEnds(const Matrix<double>& samples, const Vector<Index>& ends, const Vector<double>& reach, Index points) {
        const Index count = ends.shape(0);
        const auto low = [&](Index e, Index d) { return samples(ends(e), d) - MARGIN * reach(e); };
        const auto high = [&](Index e, Index d) { return samples(ends(e), d) + MARGIN * reach(e); };
        double most[2] = {-INFINITY, -INFINITY}, edge = 0.0;
        for (Index e = 0; e < count; ++e) {
            for (Index d = 0; d < 2; ++d) {
                low_[d] = std::min(low_[d], low(e, d));
                most[d] = std::max(most[d], high(e, d));
            }
            edge = std::max(edge, reach(e));
        }
        if (!(edge > 0)) return;
        while (((most[0] - low_[0]) / edge + 1) * ((most[1] - low_[1]) / edge + 1) > double(points) + 4096.0) edge *= 2;
        per_unit_ = 1 / edge;
        for (Index d = 0; d < 2; ++d) shape_[d] = Index((most[d] - low_[d]) * per_unit_) + 1;
        ends_.resize(shape_[0] * shape_[1]);
        for (Index e = 0; e < count; ++e) {
            Index first[2], last[2];
            for (Index d = 0; d < 2; ++d) {
                first[d] = Index((low(e, d) - low_[d]) * per_unit_);
                last[d] = std::min(Index((high(e, d) - low_[d]) * per_unit_), shape_[d] - 1);
            }
            for (Index row = first[0]; row <= last[0]; ++row) {
                for (Index column = first[1]; column <= last[1]; ++column) ends_[row * shape_[1] + column].push_back(e);
            }
        }
    }

    // The ends whose boxes may hold a point.
    const std::vector<Index>& around(const double* point) const {
        const double row = (point[0] - low_[0]) * per_unit_, column = (point[1] - low_[1]) * per_unit_;
        if (!(row >= 0 && column >= 0 && row < double(shape_[0]) && column < double(shape_[1]))) return none_;
        return ends_[Index(row) * shape_[1] + Index(column)];
    }

private:
    double low_[2] = {INFINITY, INFINITY}, per_unit_ = 1.0;
    Index shape_[2] = {0, 0};
    std::vector<std::vector<Index>> ends_;
    const std::vector<Index> none_;
};

// A point ahead of an end or beside it: its position along the tangent line, and its squared distance from that line.
struct Ahead {
    double axial, square;
    Index point;
    bool operator<(const Ahead& other) const { return axial != other.axial ? axial < other.axial : point < other.point; }
};

// Return whether a point is in the box of an end and near the tangent line there, and its offsets.
template <int D>
bool is_near_line(const double* point, const double* tip, const double* tangent, double reach, double max_offset, Ahead& ahead) {
    ahead.axial = ahead.square = 0.0;
    for (Index d = 0; d < D; ++d) {
        const double step = point[d] - tip[d];
        if (!(std::fabs(step) < reach)) return false;
        ahead.axial += step * tangent[d];
    }
    for (Index d = 0; d < D; ++d) {
        const double lateral = point[d] - tip[d] - ahead.axial * tangent[d];
        ahead.square += lateral * lateral;
    }
    return ahead.square < max_offset * max_offset;
}

// What is searched: arrays as the kernel gets them.
struct Search {
    const Matrix<double>&points, &samples;
    const Vector<Index>& ends;
    const Matrix<double>& tangents;
    const Vector<double>&reach, &max_offset, &max_gap;
    Index window;
};

// Return for each end the points near its tangent line.
template <int D>
std::vector<std::vector<Ahead>> near_lines(const Search& search) {
    const Index count = search.ends.shape(0), number = search.points.shape(0);
    std::vector<std::vector<Ahead>> near(count);
    const BoxesOfEnds boxes(search.samples, search.ends, search.reach, number);
    Ahead ahead;
    Visits visits{number};
    for (ahead.point = 0; ahead.point < number; ++ahead.point) {
        const double* point = search.points.data() + ahead.point * D;
        visits.count += Index(boxes.around(point).size());
        for (const Index e : boxes.around(point)) {
            const double *tip = search.samples.data() + search.ends(e) * D, *tangent = search.tangents.data() + e * D;
            if (is_near_line<D>(point, tip, tangent, search.reach(e), search.max_offset(e), ahead)) near[e].push_back(ahead);
        }
    }
    return near;
}

// Leave of the points near an end's tangent line, in order, those of the end up to the first stretch ahead without points.
//
// A point is the end's if the sample nearest to it, of all paths, is near the end. Points come row by row: the sample nearest to the
// one before, or the end, is near each, and only samples that are nearer than it are looked for. None are where that
// sample is nearer than all near the end: of a path that is as thick as its surroundings most points are such.
template <int D>
void keep_own(const Search& search, const NearestTarget& nearest, Index e, std::vector<Ahead>& near) {
    const Index end = search.ends(e);
    const Index first = std::max<Index>(end - search.window, 0), last = std::min(end + search.window, Index(search.samples.shape(0)) - 1);
    const double *samples = search.samples.data(), *points = search.points.data();
    Index owner = end;
    Visits visits;
    const auto is_foreign = [&](const Ahead& ahead) {
        const double* point = points + ahead.point * D;
        const double to_end = squared_distance(point, samples + end * D, D), known = squared_distance(point, samples + owner * D, D);
        if (known < to_end && (owner < first || owner > last)) {
            Index own = first;
            while (own <= last && known < squared_distance(point, samples + own * D, D)) ++own;
            visits.count += own - first;
            if (own > last) return true;
        }
        owner = nearest.find(point, to_end < known ? NearestTarget::Near{to_end, end} : NearestTarget::Near{known, owner}).index;
        return owner < first || owner > last;
    };
    near.erase(std::remove_if(near.begin(), near.end(), is_foreign), near.end());
    std::sort(near.begin(), near.end());
    for (std::size_t k = 1; k < near.size(); ++k) {
        if (near[k].axial - near[k - 1].axial > search.max_gap(e) && near[k].axial > 0) return near.resize(k);
    }
}

auto surface_ahead(Matrix<double> points, Matrix<double> samples, Vector<Index> ends, Matrix<double> tangents, Vector<double> reach,
                   Vector<double> max_offset, Vector<double> max_gap, Index window) {
    const Index size = samples.shape(0), count = ends.shape(0), dim = points.shape(1);
    require(dim == 2 || dim == 3, "points are neither (N, 2) nor (N, 3)");
    require(Index(samples.shape(1)) == dim && Index(tangents.shape(1)) == dim, "points, samples and tangents differ in coordinates");
    require(Index(tangents.shape(0)) == count && Index(reach.shape(0)) == count && Index(max_offset.shape(0)) == count &&
                Index(max_gap.shape(0)) == count, "tangents, reach, max_offset and max_gap are not one per end");
    require(window >= 0, "window is negative");
    for (Index k = 0; k < size * dim; ++k) require(std::isfinite(samples.data()[k]), "a sample is not finite");
    for (Index e = 0; e < count; ++e) {
        require(ends(e) >= 0 && ends(e) < size, "an end lies outside the samples");
        require(reach(e) > 0 && std::isfinite(reach(e)), "reach is not positive and finite");
    }
    std::vector<double> axial, lateral;
    std::vector<Index> bounds(count + 1);
    if (count > 0) {
        const Search search{points, samples, ends, tangents, reach, max_offset, max_gap, window};
        const NearestTarget nearest(samples.data(), size, dim);
        std::vector<std::vector<Ahead>> near = dim == 2 ? near_lines<2>(search) : near_lines<3>(search);
        for (Index e = 0; e < count; ++e) {
            dim == 2 ? keep_own<2>(search, nearest, e, near[e]) : keep_own<3>(search, nearest, e, near[e]);
            for (const Ahead& ahead : near[e]) {
                axial.push_back(ahead.axial);
                lateral.push_back(std::sqrt(ahead.square));
            }
            bounds[e + 1] = Index(axial.size());
        }
    }
    return std::make_tuple(std::move(axial), std::move(lateral), std::move(bounds));
}

}  // namespace

void bind_surface_ahead(Module& m) {
    // Find the surface points ahead of free ends of paths and beside them, up to the first stretch ahead without points.
    //
    // A point belongs to an end if it lies in a box around the end and near the tangent line there, and if the sample nearest to it
    // is at most `window` samples from the end.
    //
    // Parameters
    // ----------
    // points
    //     (N, D) float64, N surface points, D = 2 or 3; those that are not finite are left out
    // samples
    //     (S, D) float64, samples along all paths
    // ends
    //     (E,) int64, the sample at each of E free ends
    // tangents
    //     (E, D) float64 unit, tangent at each end, pointing out of its path
    // reach
    //     (E,) float64, half the edge of the box around each end, whose edges are along the axes of the coordinates
    // max_offset
    //     (E,) float64; points at this distance from the tangent line or farther are left out
    // max_gap
    //     (E,) float64; a stretch along the tangent without points that is longer than this ends the points ahead
    // window
    //     number of samples, those of other paths too, by which the index of the nearest sample may differ from that of the end
    //
    // Returns
    // -------
    // axial : (K,) float64, position of each point along the tangent, ascending for each end: 0 at the end, positive outside
    // lateral : (K,) float64, distance of each point from the tangent line
    // bounds : (E + 1,) int64; the points of end e are [bounds[e]:bounds[e + 1]], the last entry is K
    //
    // Notes
    // -----
    // The points are compared with the ends whose boxes reach into their cell, so that the time grows with the number of points and
    // not with that of ends.
    m.def("surface_ahead", &surface_ahead, "points"_array, "samples"_array, "ends"_array, "tangents"_array, "reach"_array,
          "max_offset"_array, "max_gap"_array, "window"_a);
}
