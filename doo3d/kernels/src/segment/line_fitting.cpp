// Straight lines through the neighborhoods of points: of a cloud of sparse points, and none where points show a surface.
#include "arrays.h"
#include "symmetric.h"
#include "vector3.h"

namespace {

// The offsets of the nearest points from one of them, and their squared distances.
struct Neighborhood {
    std::vector<Vec> offset;
    std::vector<double> square;
    Index size = 0, number = 0;  // `number` of them are within 1.2 scales
};

struct Line {
    Vec center{}, direction{};
    double points = 0.0, across = 0.0, along = 0.0, length = 0.0, own = 0.0;  // across, along: variances; own: squared distance
};

// Write the direction of the largest variance, that variance, and the sum of the two others: eigenvalues after Jacobi.
void principal_axis(double (&a)[3][3], Line& line) {
    double v[3][3];
    diagonalize(a, v);
    int largest = 0;
    for (int k = 1; k < 3; ++k) {
        if (a[k][k] >= a[largest][largest]) largest = k;
    }
    line.along = a[largest][largest];
    line.across = std::max(a[(largest + 1) % 3][(largest + 1) % 3] + a[(largest + 2) % 3][(largest + 2) % 3], 0.0);
    line.direction = {v[0][largest], v[1][largest], v[2][largest]};
}

// Of lines towards some of the neighbors take that near which most of them lie.
Vec best_direction(const Neighborhood& near, double scale, double width, Index candidates) {
    double most = -1.0;
    Vec best{};
    for (Index c = 1; c <= candidates; ++c) {
        const Index pick = std::min(std::max<Index>(1, near.number * c / (candidates + 1)), near.size - 1);
        const Vec tried = unit(near.offset[pick]);
        double score = 0.0;
        for (Index k = 0; k < near.number; ++k) {
            const double axial = dot(near.offset[k], tried), lateral = near.square[k] - axial * axial;
            score += std::fabs(axial) <= scale ? std::max(0.0, 1 - lateral / (width * width)) : 0.0;
        }
        if (score <= most) continue;
        most = score;
        best = tried;
    }
    return best;
}

// Fit a line with a known center by the covariance of its members.
void fit_direction(const Neighborhood& near, const std::vector<Byte>& member, double number, Line& line) {
    double spread[3][3] = {};
    for (Index k = 0; k < near.size; ++k) {
        if (!member[k]) continue;
        const Vec moved = minus(near.offset[k], line.center);
        for (int i = 0; i < 3; ++i) {
            for (int j = i; j < 3; ++j) spread[i][j] += moved[i] * moved[j];
        }
    }
    for (int i = 0; i < 3; ++i) {
        for (int j = i; j < 3; ++j) spread[i][j] = spread[j][i] = spread[i][j] / number;
    }
    principal_axis(spread, line);
}

// Fit a line to the neighbors within `width` of it, three times: the first time from the direction tried.
Line fit(const Neighborhood& near, double scale, double width, Index candidates, std::vector<Byte>& member) {
    Line line;
    line.direction = best_direction(near, scale, width, candidates);
    member.assign(near.size, 0);
    for (int round = 0; round < 3; ++round) {
        Vec total{};
        line.points = 0.0;
        for (Index k = 0; k < near.size; ++k) {
            const Vec moved = minus(near.offset[k], line.center);
            const double axial = dot(moved, line.direction), lateral = dot(moved, moved) - axial * axial;
            member[k] = lateral <= width * width && std::fabs(dot(near.offset[k], line.direction)) <= scale;
            if (!member[k]) continue;
            line.points += 1;
            total = plus(total, near.offset[k], 1.0);
        }
        const double number = std::max(line.points, 1.0);
        line.center = over(total, number);
        fit_direction(near, member, number, line);
    }
    const double ahead = dot(line.center, line.direction);
    double first = 0.0, last = 0.0;
    for (Index k = 0; k < near.size; ++k) {
        if (!member[k]) continue;
        first = std::min(first, dot(near.offset[k], line.direction) - ahead);
        last = std::max(last, dot(near.offset[k], line.direction) - ahead);
    }
    line.length = last - first;
    line.own = dot(line.center, line.center) - ahead * ahead;
    return line;
}

// Lines as columns, a row per position.
struct Lines {
    explicit Lines(Index size) : found(size), center(3 * size), direction(3 * size), across(size), spacing(size), scale(size), count(size) {}

    void take(Index s, const Line& line, double size, double min_points, double max_spread_ratio) {
        const double variance = line.across * line.points / std::max(line.points - 2, 1.0);
        const bool good = line.points >= min_points && variance <= max_spread_ratio * line.along &&
                          line.own <= 9 * variance + 0.1 * size * (0.1 * size);
        if (!good) return;
        found[s] = 1;
        for (int d = 0; d < 3; ++d) {
            center[3 * s + d] += line.center[d];
            direction[3 * s + d] = line.direction[d];
        }
        across[s] = std::sqrt(variance);
        spacing[s] = line.length / (line.points - 1);
        scale[s] = size;
        count[s] = Index(line.points);
    }

    std::vector<Byte> found;
    std::vector<double> center, direction, across, spacing, scale;
    std::vector<Index> count;
};

// Fill the neighborhood of a point with its `used` nearest points.
void fill(Neighborhood& near, const double* points, const double* at, const double* distance, const Index* index, Index used,
          double scale) {
    near.size = used;
    near.number = 0;
    near.offset.resize(used);
    near.square.resize(used);
    for (Index k = 0; k < used; ++k) {
        near.offset[k] = minus(vec(points + 3 * index[k]), vec(at));
        near.square[k] = distance[k] * distance[k];
        if (distance[k] <= 1.2 * scale) near.number = k + 1;
    }
}

auto fit_lines(Matrix<double> points, Matrix<double> at, Matrix<double> distance, Matrix<Index> index, Vector<double> scales,
               Vector<double> widths, Vector<double> min_points, Index candidates, double max_spread_ratio) {
    const Index size = at.shape(0), nearest = distance.shape(1), count = points.shape(0), levels = scales.shape(0);
    require(points.shape(1) == 3 && at.shape(1) == 3, "points and at are not (., 3)");
    require(Index(distance.shape(0)) == size && Index(index.shape(0)) == size && Index(index.shape(1)) == nearest,
            "distance and index are not (S, K)");
    require(Index(widths.shape(0)) == levels && Index(min_points.shape(0)) == levels, "widths and min_points are not one per scale");
    require(nearest >= 2 && candidates >= 1 && candidates <= 1000, "there are fewer than two neighbors, or no candidates");
    for (Index k = 0; k < size * nearest; ++k) require(index.data()[k] >= 0 && index.data()[k] < count, "an index lies outside the points");
    count_visits(size * nearest * levels);
    Lines lines(size);
    std::copy(at.data(), at.data() + 3 * size, lines.center.begin());
    const double *p = points.data(), *centers = at.data(), *d = distance.data();
    const Index* near_index = index.data();
    Neighborhood near;
    std::vector<Byte> member;
    std::vector<Index> todo;
    for (Index level = 0; level < levels; ++level) {
        const double scale = scales(level);
        todo.clear();
        Index used = 2;
        for (Index s = 0; s < size; ++s) {
            if (lines.found[s] || !(d[(s + 1) * nearest - 1] >= scale || nearest == count)) continue;
            todo.push_back(s);
            while (used < nearest && d[s * nearest + used] < 1.2 * scale) ++used;
        }
        for (const Index s : todo) {
            fill(near, p, centers + 3 * s, d + s * nearest, near_index + s * nearest, used, scale);
            lines.take(s, fit(near, scale, widths(level), candidates, member), scale, min_points(level), max_spread_ratio);
        }
    }
    return std::make_tuple(flags(std::move(lines.found)), rows_of(std::move(lines.center), 3),
                           rows_of(std::move(lines.direction), 3), std::move(lines.across),
                           std::move(lines.spacing), std::move(lines.scale), std::move(lines.count));
}

}  // namespace

void bind_line_fitting(Module& m) {
    // Fit a straight line to the neighborhood of each of several points, at the least scale at which there is one.
    //
    // Lines towards some of the neighbors are tried; the best is fitted three times to the neighbors near it. There is a line if it
    // has enough points, they spread little across it, and the point itself lies near it.
    //
    // Parameters
    // ----------
    // points
    //     (N, 3) float64 m
    // at
    //     (S, 3) float64 m, points of these
    // distance, index
    //     (S, K), K >= 2 nearest points of each, by ascending distance
    // scales
    //     (L,) float64 m, ascending; half lengths of a line
    // widths
    //     (L,) float64 m, distance from a line within which points belong to it, for each scale
    // min_points
    //     (L,) float64, points that a line has at least, for each scale
    // candidates
    //     neighbors towards which a line is tried
    // max_spread_ratio
    //     variance across a line at most, as a fraction of that along it
    //
    // Returns
    // -------
    // found : (S,) bool
    // center : (S, 3) float64 m, mean of the points of the line; the point itself without a line
    // direction : (S, 3) float64 unit; 0 without a line, as all that follow
    // across : (S,) float64 m, root mean square distance of the points from the line
    // spacing : (S,) float64 m, mean distance of the points along the line
    // scale : (S,) float64 m
    // count : (S,) int64, number of points of the line
    m.def("fit_lines", &fit_lines, "points"_array, "at"_array, "distance"_array, "index"_array, "scales"_array, "widths"_array,
          "min_points"_array, "candidates"_a, "max_spread_ratio"_a);
}
