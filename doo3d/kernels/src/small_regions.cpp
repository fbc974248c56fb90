// Small connected components and small holes of a mask.
#include "arrays.h"

#include <algorithm>

namespace {

struct Image {
    Byte* pixels;
    Index height, width;
};

// Call `visit` with the row-major index of each of the 4 or 8 neighbors of a pixel within the image.
template <class Visit>
void for_each_neighbor(const Image& image, Index pixel, bool diagonal, Visit visit) {
    const Index row = pixel / image.width, column = pixel % image.width;
    const bool up = row > 0, down = row + 1 < image.height, left = column > 0, right = column + 1 < image.width;
    if (up) visit(pixel - image.width);
    if (left) visit(pixel - 1);
    if (right) visit(pixel + 1);
    if (down) visit(pixel + image.width);
    if (!diagonal) return;
    if (up && left) visit(pixel - image.width - 1);
    if (up && right) visit(pixel - image.width + 1);
    if (down && left) visit(pixel + image.width - 1);
    if (down && right) visit(pixel + image.width + 1);
}

// Return the number of pixels of a component with its holes filled: the box around it without what is reached from outside.
Index filled_size(const std::vector<Index>& component, Index width) {
    if (component.size() < 4) return component.size();
    Index top = component[0] / width, bottom = top, left = component[0] % width, right = left;
    for (const Index pixel : component) {
        top = std::min(top, pixel / width);
        bottom = std::max(bottom, pixel / width);
        left = std::min(left, pixel % width);
        right = std::max(right, pixel % width);
    }
    std::vector<Byte> taken((bottom - top + 3) * (right - left + 3));
    count_visits(Index(component.size() + taken.size()));
    Image box{taken.data(), bottom - top + 3, right - left + 3};
    for (const Index pixel : component) taken[(pixel / width - top + 1) * box.width + pixel % width - left + 1] = 1;
    std::vector<Index> stack{0};
    taken[0] = 1;
    Index outside = 1;
    while (!stack.empty()) {
        const Index pixel = stack.back();
        stack.pop_back();
        for_each_neighbor(box, pixel, false, [&](Index next) {
            if (taken[next]) return;
            taken[next] = 1;
            ++outside;
            stack.push_back(next);
        });
    }
    return Index(taken.size()) - outside;
}

// Remove the 8-connected components that are small with their holes filled; return the number of their pixels.
Index remove_components(const Matrix<bool>& mask, const Image& result, Index min_pixels) {
    std::vector<Byte> seen(result.height * result.width);
    count_bytes(Index(seen.size()));
    std::vector<Index> component;
    Index removed = 0;
    for_each_set(mask, [&](Index start) {
        if (seen[start]) return;
        seen[start] = 1;
        component.assign(1, start);
        for (std::size_t next = 0; next < component.size(); ++next) {
            for_each_neighbor(result, component[next], true, [&](Index pixel) {
                if (seen[pixel] || !bytes_of(mask)[pixel]) return;
                seen[pixel] = 1;
                component.push_back(pixel);
            });
        }
        count_visits(Index(component.size()));
        if (Index(component.size()) >= min_pixels || filled_size(component, result.width) >= min_pixels) return;
        for (const Index pixel : component) result.pixels[pixel] = 0;
        removed += component.size();
    });
    return removed;
}

// Fill the 4-connected holes that are small; return the number of their pixels. The search around a pixel beside the mask ends
// when it has found enough pixels, the border of the image, or pixels of an earlier search that ended so.
Index fill_holes(const Image& image, Index min_pixels) {
    const Index size = image.height * image.width;
    std::vector<Byte> background(size);
    Visits visits{2 * size / 8};
    std::vector<Index> hole;
    Index filled = 0;
    const auto search = [&](Index start) {
        if (image.pixels[start] || background[start]) return;
        bool small = min_pixels > 1;
        background[start] = 1;
        hole.assign(1, start);
        for (std::size_t next = 0; small && next < hole.size(); ++next) {
            const Index row = hole[next] / image.width, column = hole[next] % image.width;
            small = row > 0 && column > 0 && row + 1 < image.height && column + 1 < image.width;
            if (!small) break;
            for_each_neighbor(image, hole[next], false, [&](Index pixel) {
                if (image.pixels[pixel] || background[pixel] == 1) return;
                if (background[pixel] == 2) {
                    small = false;
                    return;
                }
                background[pixel] = 1;
                hole.push_back(pixel);
            });
            small = small && Index(hole.size()) < min_pixels;
        }
        visits.count += Index(hole.size());
        for (const Index pixel : hole) {
            if (small) image.pixels[pixel] = 1;
            background[pixel] = 2;
        }
        filled += small ? Index(hole.size()) : 0;
    };
    for (Index i = first_set(image.pixels, 0, size); i < size; i = first_set(image.pixels, i + 1, size)) {
        ++visits.count;
        for_each_neighbor(image, i, false, search);
    }
    return filled;
}

auto without_small_regions(Matrix<bool> mask, Index min_pixels) {
    const Index height = mask.shape(0), width = mask.shape(1);
    auto* result = new bool[std::max<Index>(height * width, 1)]();
    nb::capsule owner(result, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    Index selected = 0;
    count_bytes(height * width);
    for_each_set(mask, [&](Index i) {
        result[i] = true;
        ++selected;
    });
    const Image image{reinterpret_cast<Byte*>(result), height, width};
    const Index removed = min_pixels > 1 ? remove_components(mask, image, min_pixels) : 0;
    const Index filled = min_pixels > 1 ? fill_holes(image, min_pixels) : 0;
    return std::make_tuple(MatrixResult<bool>(result, {std::size_t(height), std::size_t(width)}, owner), selected, removed, filled);
}

}  // namespace

void bind_small_regions(nb::module_& m) {
    m.def("without_small_regions", &without_small_regions, "mask"_a.noconvert(), "min_pixels"_a);
}
