// Lines of a 2-D skeleton: where they meet, and their spurs.
#include "zhang_suen.h"

#include <queue>

namespace {

// A 2-D skeleton as an image, 1 on the skeleton, whose outermost rows and columns are 0.
class LineImage {
public:
    LineImage(Byte* data, Index height, Index width) : data_(data), height_(height), width_(width) {
        for (int k = 0; k < 8; ++k) ring_[k] = RING_ROWS[k] * width + RING_COLUMNS[k];
    }

    void check(const Vector<Index>& rows, const Vector<Index>& columns) const {
        require(rows.shape(0) == columns.shape(0), "rows and columns have different lengths");
        count_visits(Index(rows.shape(0)) + 2 * (height_ + width_));
        for (std::size_t k = 0; k < rows.shape(0); ++k) {
            require(rows(k) > 0 && rows(k) < height_ - 1 && columns(k) > 0 && columns(k) < width_ - 1,
                    "a pixel lies in the outermost rows or columns of the image");
        }
        for (Index u = 0; u < width_; ++u) require(!data_[u] && !data_[(height_ - 1) * width_ + u], "the outermost rows are not 0");
        for (Index v = 0; v < height_; ++v) require(!data_[v * width_] && !data_[v * width_ + width_ - 1], "the outermost columns are not 0");
    }

    Index at(Index row, Index column) const { return row * width_ + column; }
    bool on(Index pixel) const { return data_[pixel] != 0; }
    void set(Index pixel, bool on) { data_[pixel] = on; }
    Index neighbor(Index pixel, int direction) const { return pixel + ring_[direction]; }

    // Count the 0-1 transitions around a pixel: 1 at a tip, 2 along a line, 3 and more at a junction.
    Index crossing_number(Index pixel) const {
        Index count = 0;
        bool before = on(neighbor(pixel, 7));
        for (int k = 0; k < 8; ++k) {
            const bool after = on(neighbor(pixel, k));
            count += after && !before;
            before = after;
        }
        return count;
    }

    // Return the direction of a neighbor on the skeleton, those that share a side first; -1 for none. Even ones share a side.
    int neighbor_direction(Index pixel) const {
        for (const int direction : {0, 2, 4, 6, 1, 3, 5, 7}) {
            if (on(neighbor(pixel, direction))) return direction;
        }
        return -1;
    }

private:
    Byte* data_;
    Index height_, width_;
    Index ring_[8];
};

auto crossing_numbers(Matrix<Byte> image, Vector<Index> rows, Vector<Index> columns) {
    const LineImage lines(const_cast<Byte*>(image.data()), image.shape(0), image.shape(1));
    lines.check(rows, columns);
    std::vector<Index> count(rows.shape(0));
    for (std::size_t k = 0; k < count.size(); ++k) {
        const Index pixel = lines.at(rows(k), columns(k));
        if (lines.on(pixel)) count[k] = lines.crossing_number(pixel);
    }
    return count;
}

// Walk along the skeleton from a tip until a junction, or until `limit` px; the image is as before afterwards.
//
// Fills the trail with the pixels walked over, without the junction. Returns the length in px, and whether a junction was reached.
std::pair<double, bool> walk_from_tip(LineImage& image, Index pixel, double limit, std::vector<Index>& trail) {
    trail.clear();
    double length = 0.0;
    bool meets = false;
    while (length < limit && !meets) {
        trail.push_back(pixel);
        image.set(pixel, false);
        const int direction = image.neighbor_direction(pixel);
        if (direction < 0) break;
        length += direction % 2 ? std::sqrt(2.0) : 1.0;
        const Index before = pixel;
        pixel = image.neighbor(pixel, direction);
        image.set(before, true);
        meets = image.crossing_number(pixel) > 2;
        image.set(before, false);
    }
    count_visits(Index(trail.size()));
    for (const Index walked : trail) image.set(walked, true);
    return {length, meets};
}

// The spurs of a skeleton, by length.
//
// Removing a spur may turn its junction into a part of a longer line. A walk sees only the pixels it passes and their neighbors, so
// after a removal the walks are made anew that passed a pixel beside a removed one, and those from pixels beside it that are tips now.
class Spurs {
public:
    Spurs(LineImage& lines, std::vector<Index>&& pixels, double min_length)
        : lines_(lines), pixels_(std::move(pixels)), min_length_(min_length), version_(pixels_.size()), first_walk_(pixels_.size(), -1) {
        count_visits(2 * Index(pixels_.size()));
        for (Index start = 0; start < Index(pixels_.size()); ++start) starts_.push_back({pixels_[start], start});
        std::sort(starts_.begin(), starts_.end());
        for (Index start = 0; start < Index(pixels_.size()); ++start) {
            if (start_at(pixels_[start]) == start) walk(start);
        }
    }

    void remove_all() {
        while (!queue_.empty()) {
            const Candidate shortest = queue_.top();
            queue_.pop();
            if (shortest.version != version_[shortest.start]) continue;
            walk_from_tip(lines_, pixels_[shortest.start], min_length_, trail_);
            const std::vector<Index> spur(trail_);
            for (const Index pixel : spur) lines_.set(pixel, false);
            update_beside(spur);
        }
    }

private:
    struct Candidate {
        double length;
        Index start, version;
        // the top of a priority queue is the largest: the shortest spur, of equal ones that of the first pixel
        bool operator<(const Candidate& other) const {
            return length != other.length ? length > other.length : start > other.start;
        }
    };
    struct Walk {
        Index start, version, next;
    };

    void walk(Index start) {
        ++version_[start];
        const Index pixel = pixels_[start];
        if (!lines_.on(pixel) || lines_.crossing_number(pixel) != 1) return;
        const auto [length, meets] = walk_from_tip(lines_, pixel, min_length_, trail_);
        if (meets && length < min_length_) queue_.push({length, start, version_[start]});
        for (const Index passed : trail_) note(passed, start);
        if (trail_.empty()) return;
        const Index end = end_of_walk();
        if (end >= 0) note(end, start);
    }

    // The pixel after the last of the trail, where the walk ended without stepping on; -1 for none.
    Index end_of_walk() {
        for (const Index passed : trail_) lines_.set(passed, false);
        const int direction = lines_.neighbor_direction(trail_.back());
        for (const Index passed : trail_) lines_.set(passed, true);
        return direction < 0 ? -1 : lines_.neighbor(trail_.back(), direction);
    }

    void note(Index pixel, Index start) {
        const Index at = start_at(pixel);
        if (at < 0) return;
        walks_.push_back({start, version_[start], first_walk_[at]});
        first_walk_[at] = Index(walks_.size()) - 1;
    }

    // The number of a pixel, of equal ones the first; -1 for one that is not among those given. There are far fewer than in the image.
    Index start_at(Index pixel) const {
        const auto found = std::lower_bound(starts_.begin(), starts_.end(), std::make_pair(pixel, Index(0)));
        return found != starts_.end() && found->first == pixel ? found->second : -1;
    }

    void update_beside(const std::vector<Index>& spur) {
        std::vector<Index> starts;
        const auto visit = [&](Index pixel) {
            const Index at = start_at(pixel);
            if (at < 0) return;
            starts.push_back(at);
            for (Index w = first_walk_[at]; w >= 0; w = walks_[w].next) {
                if (walks_[w].version == version_[walks_[w].start]) starts.push_back(walks_[w].start);
            }
            first_walk_[at] = -1;
        };
        count_visits(Index(spur.size()));
        for (const Index pixel : spur) {
            visit(pixel);
            for (int k = 0; k < 8; ++k) visit(lines_.neighbor(pixel, k));
        }
        std::sort(starts.begin(), starts.end());
        starts.erase(std::unique(starts.begin(), starts.end()), starts.end());
        for (const Index start : starts) walk(start);
    }

    LineImage& lines_;
    const std::vector<Index> pixels_;
    const double min_length_;
    std::vector<Index> version_, first_walk_, trail_;
    std::vector<std::pair<Index, Index>> starts_;
    std::vector<Walk> walks_;
    std::priority_queue<Candidate> queue_;
};

void prune_spurs(nb::ndarray<Byte, nb::ndim<2>, nb::c_contig, nb::device::cpu> image, Vector<Index> rows, Vector<Index> columns,
                 double min_length) {
    LineImage lines(image.data(), image.shape(0), image.shape(1));
    lines.check(rows, columns);
    std::vector<Index> pixels(rows.shape(0));
    for (std::size_t k = 0; k < pixels.size(); ++k) pixels[k] = lines.at(rows(k), columns(k));
    Spurs(lines, std::move(pixels), min_length).remove_all();
}

}  // namespace

void bind_spurs(Module& m) {
    // Count the lines that leave each pixel of a 2-D skeleton (Rutovitz' crossing number).
    //
    // Parameters
    // ----------
    // image
    //     (H, W) uint8, 1 on the skeleton; its outermost rows and columns are 0
    // rows, columns
    //     (K,) int64, the K pixels to count at
    //
    // Returns
    // -------
    // (K,) int64: 1 at a tip, 2 along a line, 3 and more at a junction; 0 for an isolated pixel, and where the image is 0.
    m.def("crossing_numbers", &crossing_numbers, "image"_array, "rows"_array, "columns"_array);
    // Remove the spurs of a 2-D skeleton in place, the shortest first.
    //
    // A spur is a line from a tip to a junction. A line between two tips stays, however short it is. Without a spur its junction
    // may be part of a longer line, so after each removal the spurs around it are measured anew.
    //
    // Parameters
    // ----------
    // image
    //     (H, W) uint8, 1 on the skeleton; its outermost rows and columns are 0. Changed in place
    // rows, columns
    //     (K,) int64, the K pixels of the skeleton
    // min_length
    //     px; spurs shorter than this are removed. A diagonal step counts as sqrt 2
    m.def("prune_spurs", &prune_spurs, "image"_array, "rows"_array, "columns"_array, "min_length"_a);
}
