#include "mask_runs.h"

#include "order_statistics.h"

namespace {

// Chamfer distances (Rosenfeld and Pfaltz, 1966) of the pixels of a part from those that are not in it, by a pass down and one up, in an
// image of the part's box with a pixel around it. Beyond the image of the mask nothing is known: the distance there is infinite.
class Distances {
   public:
    Distances(const Part& part, Index height, Index width)
        : part(part), box(box_of(part.runs)), height(height), width(width), pitch(box.right - box.left + 2),
          image((box.bottom - box.top + 2) * pitch) {
        set_beyond(std::numeric_limits<float>::max());
        for (const Run& run : part.runs) {
            float* pixel = at(run.row, run.start);
            for (Index k = 0; k < run.size(); ++k, ++pixel) *pixel = by_way_of(pixel, 1);
        }
        for (auto run = part.runs.rbegin(); run != part.runs.rend(); ++run) {
            float* pixel = at(run->row, run->end);
            for (Index k = 0; k < run->size(); ++k) {
                --pixel;
                *pixel = std::min(*pixel, by_way_of(pixel, -1));
                largest = std::max(largest, *pixel);
            }
        }
        set_beyond(0.0f);
    }
    ~Distances() {
        for (const Run& run : part.runs) std::fill_n(at(run.row, run.start), run.size(), 0.0f);
    }

    // Return the half-widths at the pixels that are as far from the edge as all around them.
    std::vector<float> middle() {
        std::vector<float> found;
        for (const Run& run : part.runs) {
            const float* own = at(run.row, run.start);
            for (Index k = 0; k < run.size(); ++k, ++own) {
                const float *up = own - pitch, *down = own + pitch;
                const float beside = std::max({up[-1], up[0], up[1], own[-1], own[1], down[-1], down[0], down[1]});
                if (*own >= beside - 1e-3f) found.push_back(*own - 0.5f);
            }
        }
        return found;
    }

    float largest = 0.0f;

   private:
    const Part& part;
    const Box box;
    const Index height, width, pitch;
    Zeros<float> image;

    float* at(Index row, Index column) { return image.data() + (row - box.top + 1) * pitch + column - box.left + 1; }

    // Return the least distance by way of the pixels above and to the left, or with -1 of those below and to the right.
    float by_way_of(const float* pixel, Index forward) const {
        const float straight = std::min(pixel[-forward], pixel[-forward * pitch]) + float(STRAIGHT);
        return std::min(straight, std::min(pixel[-forward * (pitch + 1)], pixel[-forward * (pitch - 1)]) + float(DIAGONAL));
    }

    void set_beyond(float value) {
        for (const Index row : {Index(-1), height}) {
            if (row >= box.top - 1 && row <= box.bottom) std::fill_n(at(row, box.left - 1), pitch, value);
        }
        for (const Index column : {Index(-1), width}) {
            for (Index row = box.top - 1; row <= box.bottom && column >= box.left - 1 && column <= box.right; ++row) *at(row, column) = value;
        }
    }
};

}  // namespace

double thickness(const Part& part, Index height, Index width) {
    count_visits(2 * part.size);
    return Distances(part, height, width).largest;
}

MeasuredParts measure(const std::vector<Part>& parts, Index height, Index width, Index min_pixels, const BitImage& asked) {
    MeasuredParts found;
    for (const Part& part : parts) {
        bool holds = false;
        for (const Run& run : part.runs) {
            for (Index x = run.start; x < run.end; ++x) {
                found.pixels.push_back(run.row * width + x);
                holds |= asked.has(run.row, x);
            }
        }
        found.starts.push_back(std::int64_t(found.pixels.size()));
        found.holds.push_back(holds);
        const bool is_measured = !holds && part.size >= min_pixels;
        const std::vector<float> middle = is_measured ? Distances(part, height, width).middle() : std::vector<float>();
        for (const double share : {0.5, 0.85}) found.half.push_back(middle.empty() ? 0.0f : quantile(middle, share));
    }
    return found;
}
