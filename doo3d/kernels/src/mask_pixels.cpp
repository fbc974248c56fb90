// The True pixels of a mask.
#include "arrays.h"

namespace {

// Rows top to bottom and columns left to right that hold the True pixels; the ends are exclusive, and all are 0 if there are none.
struct Box {
    Index top = 0, bottom = 0, left = 0, right = 0;
};

// Return one more than the last index in [begin, end) whose byte is not 0, or begin.
Index last_set(const Byte* bytes, Index begin, Index end) {
    for (std::uint64_t word; begin + 8 <= end; end -= 8) {
        std::memcpy(&word, bytes + end - 8, 8);
        if (word) break;
    }
    while (end > begin && !bytes[end - 1]) --end;
    return end;
}

Box box_of(const Matrix<bool>& mask) {
    const Index height = mask.shape(0), width = mask.shape(1);
    const Byte* bytes = bytes_of(mask);
    count_bytes(height * width);
    const Index first = first_set(bytes, 0, height * width), stop = last_set(bytes, first, height * width);
    if (first == stop) return Box();
    Box box{first / width, (stop - 1) / width + 1, width, 0};
    for (Index row = box.top; row < box.bottom; ++row) {
        const Byte* pixels = bytes + row * width;
        box.left = first_set(pixels, 0, box.left);
        box.right = last_set(pixels, box.right, width);
    }
    return box;
}

auto bounding_box(Matrix<bool> mask) {
    const Box box = box_of(mask);
    return std::make_tuple(box.top, box.bottom, box.left, box.right);
}

auto mask_pixels(Matrix<bool> mask) {
    const Box box = box_of(mask);
    const Index width = mask.shape(1), columns = box.right - box.left;
    std::vector<Index> next(columns + 1);
    for_each_set(mask, [&](Index i) { ++next[i % width - box.left + 1]; });
    for (Index column = 0; column < columns; ++column) next[column + 1] += next[column];
    const Index count = next[columns];
    std::vector<Index> found(2 * count);
    for_each_set(mask, [&](Index i) {
        Index* pixel = found.data() + 2 * next[i % width - box.left]++;
        pixel[0] = i % width;
        pixel[1] = i / width;
    });
    return to_numpy(std::move(found), count, 2);
}

}  // namespace

void bind_mask_pixels(nb::module_& m) {
    m.def("bounding_box", &bounding_box, "mask"_a.noconvert());
    m.def("mask_pixels", &mask_pixels, "mask"_a.noconvert());
}
