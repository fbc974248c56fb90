// Zhang-Suen thinning of a mask to lines one pixel wide, with every deletion checked again.
//
// The two sub-iterations are those of the paper (Zhang and Suen, CACM 27, 1984). The original deletes in parallel and can lose small
// blobs and leave lines two pixels wide; with the check at each deletion connected stays connected, and holes stay holes.
#include "zhang_suen.h"

namespace {

// The rules for the 256 neighborhoods: deletable in the first and in the second sub-iteration; simple and no end.
//
// Simple: exactly one 8-connected piece of the object among the neighbors, and one 4-connected piece of background
// that touches a side (the Yokoi number is 1).
struct Rules {
    std::array<std::array<bool, 256>, 2> deletable{};
    std::array<bool, 256> simple{};

    Rules() {
        for (int code = 0; code < 256; ++code) {
            auto bit = [code](int k) { return code >> (k % 8) & 1; };
            int count = 0, rises = 0, yokoi = 0;
            for (int k = 0; k < 8; ++k) {
                count += bit(k);
                rises += !bit(k) && bit(k + 1);
            }
            for (int k = 0; k < 8; k += 2) yokoi += (1 - bit(k)) * (1 - (1 - bit(k + 1)) * (1 - bit(k + 2)));
            const bool base = count >= 2 && count <= 6 && rises == 1;
            const int p2 = bit(0), p4 = bit(2), p6 = bit(4), p8 = bit(6);
            deletable[0][code] = base && !(p2 && p4 && p6) && !(p4 && p6 && p8);
            deletable[1][code] = base && !(p2 && p4 && p8) && !(p2 && p6 && p8);
            simple[code] = yokoi == 1 && count > 1;
        }
    }
};

const Rules RULES;

}  // namespace

// A sub-iteration collects the pixels with a deletable code and then deletes them, each if it still is simple. A deleted pixel has the
// code 0, and so has one without neighbors, which stays; a pixel never loses its last neighbor. The two repeat until none deletes; a
// last pass takes the corners of staircases. Which pixels are deletable no processor can foresee: both lists are written without
// branches.
void thin_codes(Byte* codes, Index width, std::vector<std::int32_t> active) {
    std::int32_t offsets[8];
    for (int k = 0; k < 8; ++k) offsets[k] = std::int32_t(RING_ROWS[k] * width + RING_COLUMNS[k]);
    std::vector<std::int32_t> chosen(active.size());
    Visits visits;
    const auto remove_simple = [&](const std::vector<std::int32_t>& pixels, std::size_t count) {
        bool changed = false;
        for (std::size_t i = 0; i < count; ++i) {
            const std::int32_t pixel = pixels[i];
            if (!RULES.simple[codes[pixel]]) continue;
            codes[pixel] = 0;
            for (int k = 0; k < 8; ++k) codes[pixel - offsets[k]] &= Byte(~(1 << k));
            changed = true;
        }
        return changed;
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (const auto& deletable : RULES.deletable) {
            std::size_t left = 0, count = 0;
            for (const std::int32_t pixel : active) {
                const Byte code = codes[pixel];
                active[left] = chosen[count] = pixel;
                left += code != 0;
                count += deletable[code];
            }
            visits.count += Index(active.size() + count);
            active.resize(left);
            changed |= remove_simple(chosen, count);
        }
    }
    remove_simple(active, active.size());
}

namespace {

auto thin_pixels(StridedMatrix<Index> coords) {
    const Index count = coords.shape(0);
    require(coords.shape(1) == 2, "coords are not (N, 2)");
    Index height = 1, width = 1;
    for (Index i = 0; i < count; ++i) {
        require(coords(i, 0) >= 1 && coords(i, 1) >= 1, "coords are not 1 or more");
        height = std::max(height, coords(i, 0) + 2);
        width = std::max(width, coords(i, 1) + 2);
    }
    require(double(height) * double(width) < 2e9, "the box of the pixels is too large");
    std::vector<std::int32_t> pixels(count);
    std::vector<Byte> object(height * width), kept(count);
    count_bytes(2 * height * width);
    count_visits(3 * count);
    for (Index i = 0; i < count; ++i) {
        pixels[i] = std::int32_t(coords(i, 0) * width + coords(i, 1));
        require(i == 0 || pixels[i - 1] < pixels[i], "coords are not in lexicographic order");
        object[pixels[i]] = 1;
    }
    std::vector<Byte> codes(object.size());
    for (Index i = 0; i < count; ++i) {
        for (int k = 0; k < 8; ++k) codes[pixels[i]] |= Byte(object[pixels[i] + RING_ROWS[k] * width + RING_COLUMNS[k]] << k);
        kept[i] = codes[pixels[i]] == 0;
    }
    thin_codes(codes.data(), width, pixels);
    for (Index i = 0; i < count; ++i) kept[i] |= codes[pixels[i]] != 0;
    return flags(std::move(kept));
}

}  // namespace

void bind_zhang_suen(Module& m) {
    // Tell which pixels of a mask belong to its skeleton, lines one pixel wide (Zhang-Suen thinning).
    //
    // Pieces of the mask that were connected stay connected, holes stay holes, and an isolated pixel stays.
    //
    // coords : (N, 2) int64 >= 1, row and column of each of N pixels, in lexicographic order. Returns (N,) bool, True on the
    // skeleton.
    m.def("thin_pixels", &thin_pixels, "coords"_array);
}
