// CIELAB of 8 bits, the same numbers as OpenCV's.
#pragma once

#include "arrays.h"

// Return the share of light, 0 to 1, of an 8-bit value of sRGB.
inline double linear_light(std::size_t value) {
    const double v = double(value) / 255;
    return v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92;
}

// Integer arithmetic with tables: light of 11 bits, and its cube root of 15.
class LabTables {
   public:
    LabTables() {
        for (std::size_t i = 0; i < light.size(); ++i) light[i] = std::uint16_t(std::lround(2040 * linear_light(i)));
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
