// Positions in an image, and the camera that sees points there.
#pragma once

#include "arrays.h"

// Return the row-major index of the pixel at a position, px (u, v); -1 beyond the image.
inline Index pixel_at(double u, double v, Index height, Index width) {
    u = std::nearbyint(u);
    v = std::nearbyint(v);
    return u >= 0 && v >= 0 && u < double(width) && v < double(height) ? Index(v) * width + Index(u) : -1;
}

// Return the index (0 to size - 1) that an index beyond is mirrored to, at the middle of the first and the last pixel.
inline Index mirrored(Index i, Index size) {
    while (size > 1 && (i < 0 || i >= size)) i = i < 0 ? -i : 2 * (size - 1) - i;
    return size > 1 ? i : 0;
}

// A pinhole camera; lengths in px.
struct Camera {
    double fx, fy, cx, cy;

    explicit Camera(const Vector<double>& intrinsics) {
        require(intrinsics.shape(0) == 4, "camera is not (4,)");
        fx = intrinsics(0), fy = intrinsics(1), cx = intrinsics(2), cy = intrinsics(3);
    }
    // Write the position (u, v) at which a point (x, y, z) is seen; NaN behind the camera.
    void project(const double* point, double* position) const {
        const double z = point[2] > 0 ? point[2] : std::nan("");
        position[0] = fx * point[0] / z + cx;
        position[1] = fy * point[1] / z + cy;
    }
};

// Return the camera of (4,) intrinsics, or none of (0,).
inline std::optional<Camera> camera_of(const Vector<double>& intrinsics) {
    return intrinsics.shape(0) ? std::make_optional<Camera>(intrinsics) : std::nullopt;
}

// The readings of depth, m, that count: those in a mask of the same shape, or those outside of it.
struct MaskedDepth {
    const Matrix<float>& depth;
    const Matrix<bool>& mask;

    void check() const {
        require(depth.shape(0) == mask.shape(0) && depth.shape(1) == mask.shape(1), "depth and mask have different shapes");
    }
    Index pixel(double u, double v) const { return pixel_at(u, v, depth.shape(0), depth.shape(1)); }
    // Return the reading at a position (u, v); NaN beyond the image, where there is none, and where the mask is not as wanted.
    float at(double u, double v, bool in_mask) const {
        const Index pixel = this->pixel(u, v);
        if (pixel < 0 || bool(bytes_of(mask)[pixel]) != in_mask || !(depth.data()[pixel] > 0)) return std::nanf("");
        return depth.data()[pixel];
    }
};
