// Drawing of antialiased strokes on a transparent layer, and of the layer over an image.
//
// A stroke is the union of the parts between consecutive points of a polyline: each part is a capsule whose half-width changes
// linearly along it. A pixel's coverage by a stroke is the largest of its parts, so parts that overlap show no seams, and the stroke
// is blended into the layer once. Only the pixels of a row between the outermost touched ones are looked at, so the work follows
// the strokes and not the size of the layer. A thread that draws lets others run: no Python object is touched while it does.

#include "arrays.h"

namespace {

using Pixels = nb::ndarray<Byte, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// One point of a stroke, px.
struct Node {
    double x, y, half_width;
};

double share(double value) { return std::min(1.0, std::max(0.0, value)); }

// The share of each pixel that a stroke covers, 0 to 255, and the columns touched in each row.
class Coverage {
public:
    Coverage(Index height, Index width) : height_(height), width_(width), cover_(height * width), low_(height, width), high_(height) {}

    // Add the capsule between two points; a blunt end is cut off at the point, others are round.
    void add(const Node& a, const Node& b, bool blunt_a, bool blunt_b) {
        const double reach = std::max(a.half_width, b.half_width) + 0.5;
        const double step_x = b.x - a.x, step_y = b.y - a.y, squared = step_x * step_x + step_y * step_y, length = std::sqrt(squared);
        const Index first = row_within(std::ceil(std::min(a.y, b.y) - reach));
        const Index last = row_within(std::floor(std::max(a.y, b.y) + reach) + 1);
        top_ = std::min(top_, first);
        bottom_ = std::max(bottom_, last);
        for (Index row = first; row < last; ++row) {
            // the x of the part of the segment that is within reach of the row
            const double begin = step_y != 0.0 ? share((row - a.y - std::copysign(reach, step_y)) / step_y) : 0.0;
            const double end = step_y != 0.0 ? share((row - a.y + std::copysign(reach, step_y)) / step_y) : 1.0;
            const double x_begin = a.x + begin * step_x, x_end = a.x + end * step_x;
            const Index from = column_within(std::ceil(std::min(x_begin, x_end) - reach));
            const Index to = column_within(std::floor(std::max(x_begin, x_end) + reach) + 1);
            if (from >= to) continue;
            low_[row] = std::min(low_[row], from);
            high_[row] = std::max(high_[row], to);
            Byte* pixels = cover_.data() + row * width_;
            for (Index column = from; column < to; ++column) {
                const double x = column - a.x, y = row - a.y;
                const double along = squared > 0.0 ? (x * step_x + y * step_y) / squared : 0.0, at = share(along);
                const double off_x = x - at * step_x, off_y = y - at * step_y;
                const double half_width = a.half_width + (b.half_width - a.half_width) * at, distance = off_x * off_x + off_y * off_y;
                if (half_width < -0.5 || distance > (half_width + 0.5) * (half_width + 0.5)) continue;
                double covered = half_width + 0.5 - std::sqrt(distance);
                if (blunt_a) covered = std::min(covered, 0.5 + along * length);
                if (blunt_b) covered = std::min(covered, 0.5 + (1.0 - along) * length);
                const Byte level = Byte(255.0 * share(covered) + 0.5);
                pixels[column] = std::max(pixels[column], level);
            }
        }
    }

    // Blend a premultiplied RGBA color into a layer where the stroke is, and forget the stroke.
    void blend(Byte* layer, const Byte* color) {
        for (Index row = top_; row < bottom_; ++row) {
            const Index stop = row * width_ + high_[row];
            for (Index i = first_set(cover_.data(), row * width_ + low_[row], stop); i < stop; i = first_set(cover_.data(), i + 1, stop)) {
                const int covered = cover_[i];
                cover_[i] = 0;
                for (int k = 0; k < 4; ++k) {
                    Byte& value = layer[4 * i + k];
                    value = Byte((value * (255 - covered) + color[k] * covered + 127) / 255);
                }
            }
            low_[row] = width_;
            high_[row] = 0;
        }
        top_ = height_;
        bottom_ = 0;
    }

private:
    Index row_within(double row) const { return Index(std::min(double(height_), std::max(0.0, row))); }
    Index column_within(double column) const { return Index(std::min(double(width_), std::max(0.0, column))); }

    Index height_, width_, top_ = height_, bottom_ = 0;
    std::vector<Byte> cover_;
    std::vector<Index> low_, high_;
};

void paint_strokes(Pixels layer, Matrix<double> points, Vector<Index> stops, Matrix<Byte> colors, Vector<bool> blunt) {
    const Index count = points.shape(0), strokes = stops.shape(0);
    require(layer.shape(2) == 4, "layer is not RGBA");
    require(points.shape(1) == 3, "points are not (P, 3)");
    require(Index(colors.shape(0)) == strokes && colors.shape(1) == 4, "colors are not (S, 4)");
    require(Index(blunt.shape(0)) == strokes, "blunt is not (S,)");
    count_visits(count);
    std::vector<Node> nodes(count);
    for (Index i = 0; i < count; ++i) {
        nodes[i] = {points(i, 0), points(i, 1), points(i, 2)};
        require(std::isfinite(nodes[i].x) && std::isfinite(nodes[i].y) && std::isfinite(nodes[i].half_width), "a point is not finite");
    }
    std::vector<Index> limits(strokes + 1);
    for (Index s = 0; s < strokes; ++s) {
        limits[s + 1] = stops(s);
        require(limits[s] < limits[s + 1] && limits[s + 1] <= count, "a stroke has no points");
    }
    std::vector<Byte> is_blunt(strokes);
    for (Index s = 0; s < strokes; ++s) is_blunt[s] = blunt(s);
    Coverage coverage(layer.shape(0), layer.shape(1));
    for (Index s = 0; s < strokes; ++s) {
        const Index first = limits[s], last = limits[s + 1] - 1;
        if (first == last) coverage.add(nodes[first], nodes[first], false, false);
        for (Index i = first; i < last; ++i) coverage.add(nodes[i], nodes[i + 1], is_blunt[s] && i == first, is_blunt[s] && i + 1 == last);
        coverage.blend(layer.data(), colors.data() + 4 * s);
    }
}

void blend_layer(Pixels picture, Volume<Byte> layer) {
    require(picture.shape(2) == 3 && layer.shape(2) == 4, "picture is not RGB, or layer not RGBA");
    require(picture.shape(0) == layer.shape(0) && picture.shape(1) == layer.shape(1), "picture and layer have different sizes");
    const Index count = picture.shape(0) * picture.shape(1);
    count_visits(count);
    Byte* below = picture.data();
    const Byte* above = layer.data();
    for (Index i = 0; i < count; ++i, below += 3, above += 4) {
        const int opacity = above[3];
        if (opacity == 0) continue;
        for (int k = 0; k < 3; ++k) below[k] = Byte(std::min(255, above[k] + (below[k] * (255 - opacity) + 127) / 255));
    }
}

}  // namespace

void bind_strokes(Module& m) {
    // Blend a transparent layer over a picture in place.
    //
    // Parameters
    // ----------
    // picture
    //     (H, W, 3) uint8 RGB. Changed in place
    // layer
    //     (H, W, 4) uint8 RGBA, the colors premultiplied by the opacity
    m.def("blend_layer", &blend_layer, "picture"_array, "layer"_array);
    // Draw antialiased strokes on a transparent layer in place, one after the other; each replaces what is below it.
    //
    // A stroke is a polyline with a half-width at each point, which changes linearly from one to the next; a single point is a disc.
    // Pixel (column, row) has its center at (x, y) = (column, row), and is covered by the part of it that the stroke reaches across.
    //
    // Parameters
    // ----------
    // layer
    //     (H, W, 4) uint8 RGBA, the colors premultiplied by the opacity. Changed in place
    // points
    //     (P, 3) px, the points of all strokes: x, y and half-width
    // stops
    //     (S,) int64, the end of each of S strokes in `points`, exclusive; the first begins at 0, others where the last one ended
    // colors
    //     (S, 4) uint8, the color of each stroke, premultiplied RGBA
    // blunt
    //     (S,), whether a stroke is cut off at its first and its last point; otherwise its ends are round
    m.def("paint_strokes", &paint_strokes, "layer"_array, "points"_array, "stops"_array, "colors"_array, "blunt"_array);
}
