// The middle and the width of a mask across paths.
#pragma once

#include "image.h"
#include "nearest.h"

// Samples along paths, with the unit axes along and across each: (count, dim) in space, or in the image where there is no camera.
struct SilhouetteSamples {
    Index count;
    const double *positions, *tangents, *lateral;
    const Camera* camera;
};

// Pixels (u, v) of a mask, (count, 2), and how many pixels each stands for.
struct MaskPixels {
    const double* pixels;
    Index count;
    double share;
};

// From each sample to the middle of the mask, and half its width: (S,) in the unit of the positions.
struct Silhouette {
    std::vector<double> offset, radius;
};

// Every pixel within `reach` of the nearest sample belongs to it. The number of pixels of a sample and of `half` neighbors on either
// side, over their length in the image, is the width there.
Silhouette measure_silhouette(const SilhouetteSamples& samples, const std::vector<Index>& path, const MaskPixels& mask,
                              const std::vector<double>& reach, Index half);
