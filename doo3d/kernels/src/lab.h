// CIELAB of 8 bits, the same numbers as OpenCV's.
#pragma once

#include "arrays.h"

#include <algorithm>
#include <array>
#include <iterator>

// Integer arithmetic with tables: light of 11 bits, and its cube root of 15.
class LabTables {
   public:
    LabTables() {
        for (std::size_t i = 0; i < light.size(); ++i) {
            const double v = double(i) / 255;
            light[i] = std::uint16_t(std::lround(2040 * (v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92)));
        }
        for (std::size_t i = 0; i < root.size(); ++i) {  // rounded as OpenCV does, in single precision
            const double t = double(i) / 2040;
            root[i] = std::uint16_t(std::nearbyint(float(32768 * (t > 216.0 / 24389.0 ? std::cbrt(t) : t * 841.0 / 108.0 + 16.0 / 116.0))));
        }
    }
    void operator()(const Byte* rgb, Byte* lab) const {
        const int r = light[rgb[0]], g = light[rgb[1]], b = light[rgb[2]];
        const int x = root[(1777 * r + 1541 * g + 778 * b + 2048) >> 12], y = root[(871 * r + 2929 * g + 296 * b + 2048) >> 12];
        const int z = root[(73 * r + 448 * g + 3575 * b + 2048) >> 12];
        lab[0] = lightness(y);
        lab[1] = axis(500, x, y);
        lab[2] = axis(200, y, z);
    }

    // Convert pixels in place, a block at a time: what is no look-up is for vector instructions.
    WITH_AVX2 void convert(Byte* pixels, std::size_t count) const {
        int r[64], g[64], b[64];
        Byte lab[3][64];
        for (std::size_t i; count; count -= i, pixels += 3 * i) {
            const std::size_t size = std::min(count, std::size(r));
            for (i = 0; i < size; ++i) r[i] = light[pixels[3 * i]], g[i] = light[pixels[3 * i + 1]], b[i] = light[pixels[3 * i + 2]];
            for (i = size; i < std::size(r); ++i) r[i] = g[i] = b[i] = 0;
            for (i = 0; i < std::size(r); ++i) {
                const int x = (1777 * r[i] + 1541 * g[i] + 778 * b[i] + 2048) >> 12, y = (871 * r[i] + 2929 * g[i] + 296 * b[i] + 2048) >> 12;
                b[i] = (73 * r[i] + 448 * g[i] + 3575 * b[i] + 2048) >> 12, r[i] = x, g[i] = y;
            }
            for (i = 0; i < size; ++i) r[i] = root[r[i]], g[i] = root[g[i]], b[i] = root[b[i]];
            for (i = 0; i < std::size(r); ++i) {
                lab[0][i] = lightness(g[i]);
                lab[1][i] = axis(500, r[i], g[i]);
                lab[2][i] = axis(200, g[i], b[i]);
            }
            for (i = 0; i < size; ++i) pixels[3 * i] = lab[0][i], pixels[3 * i + 1] = lab[1][i], pixels[3 * i + 2] = lab[2][i];
        }
    }

   private:
    std::array<std::uint16_t, 256> light;
    std::array<std::uint16_t, 2041> root;
    static Byte lightness(int y) { return byte((296 * y - 1336934 + 16384) >> 15); }
    static Byte axis(int scale, int first, int second) { return byte((scale * (first - second) + 128 * 32768 + 16384) >> 15); }
    static Byte byte(int value) { return Byte(value < 0 ? 0 : value > 255 ? 255 : value); }
};

inline const LabTables& lab_tables() {
    static const LabTables tables;
    return tables;
}
