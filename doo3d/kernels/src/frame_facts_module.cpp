// FrameFacts and the functions of a mask alone, as Python sees them.
#include "depth_facts.h"
#include "lattice_pixels.h"
#include "mask_closing.h"

#include <nanobind/stl/optional.h>

#include <algorithm>
#include <optional>

namespace {

// The facts, with the depth that Python gave, if any.
struct Facts : FrameFacts {
    std::optional<Matrix<float>> depth;

    using FrameFacts::FrameFacts;

    const float* readings() const {
        require(depth.has_value(), "the facts were made without depth");
        return depth->data();
    }
};

void make(Facts* self, Matrix<bool> mask, std::optional<Matrix<float>> depth, Index min_pixels) {
    require(mask.shape(0) < (1u << 30) && mask.shape(1) < (1u << 30), "the mask is too large");
    require(!depth || (depth->shape(0) == mask.shape(0) && depth->shape(1) == mask.shape(1)), "depth and mask have different shapes");
    const Byte* bytes = bytes_of(mask);
    {
        nb::gil_scoped_release released;
        new (self) Facts(bytes, Index(mask.shape(0)), Index(mask.shape(1)), min_pixels);
    }
    self->depth = std::move(depth);
}

auto box_tuple(const FrameFacts& facts) {
    const Box& box = facts.box();
    return std::make_tuple(box.top, box.bottom, box.left, box.right);
}

auto mask_image(const FrameFacts& facts) {
    const std::size_t height = facts.height(), width = facts.width();
    auto* image = new bool[std::max<std::size_t>(height * width, 1)]();
    nb::capsule owner(image, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    for (const Run& run : facts.runs()) std::fill(image + run.row * width + run.start, image + run.row * width + run.end, true);
    return MatrixResult<bool>(image, {height, width}, owner);
}

// Hand pixels, u and v in turn, to NumPy as (N, 2).
MatrixResult<Index> to_pairs(std::vector<Index>&& pixels) {
    const std::size_t count = pixels.size() / 2;
    return to_numpy(std::move(pixels), count, 2);
}

// Sorted by column by counting the pixels of each.
auto pixels(const FrameFacts& facts) {
    std::vector<Index> next(facts.columns() + 1), found(2 * facts.count());
    {
        nb::gil_scoped_release released;
        const Index left = facts.box().left;
        facts.for_each_pixel([&](Index, Index column) { ++next[column - left + 1]; });
        for (Index column = 0; column < facts.columns(); ++column) next[column + 1] += next[column];
        facts.for_each_pixel([&](Index row, Index column) {
            Index* pixel = found.data() + 2 * next[column - left]++;
            pixel[0] = column;
            pixel[1] = row;
        });
    }
    return to_pairs(std::move(found));
}

auto axis(FrameFacts& facts) {
    MedialAxis found;
    {
        nb::gil_scoped_release released;
        found = facts.axis();
    }
    return std::make_tuple(to_numpy(std::move(found.rows)), to_numpy(std::move(found.columns)), to_numpy(std::move(found.distances)));
}

auto skeleton(FrameFacts& facts) {
    std::vector<Index> found;
    {
        nb::gil_scoped_release released;
        const Index width = facts.columns() + 2;
        for (const Index pixel : facts.skeleton()) {
            found.insert(found.end(), {pixel % width - 1 + facts.box().left, pixel / width - 1 + facts.box().top});
        }
    }
    return to_pairs(std::move(found));
}

auto lattice_pixels(const Facts& facts, Index most, double golden) {
    require(most > 0 && golden > 1, "most is not positive, or golden is not more than 1");
    LatticePixels found;
    {
        nb::gil_scoped_release released;
        found = lattice_of(facts.runs(), facts.width(), most, golden);
    }
    const std::size_t kept = found.pixels.size() / 2;
    return std::make_tuple(to_numpy(std::move(found.pixels), kept, 2), double(found.count) / double(std::max<std::size_t>(1, kept)));
}

auto core_pixels(Facts& facts, Matrix<Index> pixels, Index reach, double fraction, double margin) {
    require(pixels.shape(1) == 2, "pixels are not (N, 2)");
    require(reach >= 0, "reach is negative");
    std::vector<Byte> core;
    {
        const Index count = pixels.shape(0);
        const Index* data = pixels.data();
        nb::gil_scoped_release released;
        core = facts.in_core(data, count, reach, float(fraction), float(margin));
    }
    return to_numpy_bool(core);
}

auto middle_pixels(Facts& facts, Matrix<Index> pixels, double reach) {
    require(pixels.shape(1) == 2, "pixels are not (N, 2)");
    require(reach >= 0, "reach is negative");
    std::vector<Byte> middle;
    {
        const Index count = pixels.shape(0);
        const Index* data = pixels.data();
        nb::gil_scoped_release released;
        middle = facts.near_skeleton(data, count, reach);
    }
    return to_numpy_bool(middle);
}

Index closed_core(const Facts& facts, Vector<Index> half_widths, double distance) {
    const std::vector<Index> shape = checked_shape(half_widths, distance, facts.height(), facts.width());
    nb::gil_scoped_release released;
    return closed_mask(facts, shape, distance).deep;
}

auto depth_summary(const Facts& facts) {
    const float* depth = facts.readings();
    DepthSummary found;
    {
        nb::gil_scoped_release released;
        found = summarize_depth(facts, depth);
    }
    return std::make_tuple(found.readings, found.median, found.noise);
}

double depth_deviation(const Facts& facts, Index pixels) {
    const float* depth = facts.readings();
    require(pixels > 0, "pixels is not over 0");
    nb::gil_scoped_release released;
    return inverse_depth_noise(facts, depth, pixels);
}

auto agreeing(const Facts& facts, double low, double high, Index half_width, double slope, Index min_agreeing) {
    const float* depth = facts.readings();
    require(half_width >= 0, "half_width is negative");
    AgreeingReadings found;
    {
        nb::gil_scoped_release released;
        found = agreeing_readings(facts, depth, float(low), float(high), half_width, slope, min_agreeing);
    }
    return std::make_tuple(to_pairs(std::move(found.pixels)), to_numpy(std::move(found.depth)),
                           to_numpy(std::move(found.means)), found.dropped);
}

auto holes(const Facts& facts, Matrix<Index> kept, Index reach) {
    const float* depth = facts.readings();
    require(kept.shape(1) == 2, "kept is not (N, 2)");
    require(reach >= 0, "reach is negative");
    std::vector<Index> found;
    {
        const Index count = kept.shape(0);
        const Index* pixels = kept.data();
        nb::gil_scoped_release released;
        found = depth_holes(facts, depth, pixels, count, reach);
    }
    return to_pairs(std::move(found));
}

// Pixels of an axis relative to the mask's first row and column are those of the image.
auto medial_axis(Matrix<bool> mask) {
    ReleasedGil released;
    FrameFacts facts(bytes_of(mask), mask.shape(0), mask.shape(1), 0);
    released.end();
    return axis(facts);
}

auto bounding_box(Matrix<bool> mask) { return box_tuple(FrameFacts(bytes_of(mask), mask.shape(0), mask.shape(1), 0)); }

auto mask_pixels(Matrix<bool> mask) { return pixels(FrameFacts(bytes_of(mask), mask.shape(0), mask.shape(1), 0)); }

}  // namespace

void bind_frame_facts(nb::module_& m) {
    nb::class_<Facts>(m, "FrameFacts")
        .def("__init__", &make, "mask"_a.noconvert(), "depth"_a.noconvert() = nb::none(), "min_pixels"_a = 0)
        .def_prop_ro("selected", [](const Facts& facts) { return facts.selected(); })
        .def_prop_ro("removed", [](const Facts& facts) { return facts.removed(); })
        .def_prop_ro("filled", [](const Facts& facts) { return facts.filled(); })
        .def_prop_ro("count", [](const Facts& facts) { return facts.count(); })
        .def_prop_ro("box", [](const Facts& facts) { return box_tuple(facts); })
        .def("image", [](const Facts& facts) { return mask_image(facts); })
        .def("pixel_list", [](const Facts& facts) { return pixels(facts); })
        .def("medial_axis", [](Facts& facts) { return axis(facts); })
        .def("skeleton_pixels", [](Facts& facts) { return skeleton(facts); })
        .def("closed_core", &closed_core, "half_widths"_a.noconvert(), "distance"_a)
        .def("lattice_pixels", &lattice_pixels, "most"_a, "golden"_a)
        .def("core_pixels", &core_pixels, "pixels"_a.noconvert(), "reach"_a, "fraction"_a, "margin"_a)
        .def("middle_pixels", &middle_pixels, "pixels"_a.noconvert(), "reach"_a)
        .def("depth_summary", &depth_summary)
        .def("inverse_depth_deviation", &depth_deviation, "pixels"_a)
        .def("agreeing_readings", &agreeing, "low"_a, "high"_a, "half_width"_a, "slope"_a, "min_agreeing"_a)
        .def("depth_holes", &holes, "kept"_a.noconvert(), "reach"_a);
    m.def("medial_axis", &medial_axis, "mask"_a.noconvert());
    m.def("bounding_box", &bounding_box, "mask"_a.noconvert());
    m.def("mask_pixels", &mask_pixels, "mask"_a.noconvert());
}
