// Axes measured inside a plane that is seen beside them, raised to lie on it.
#pragma once

#include "image.h"

// What a camera sees beside strands on a plane.
struct PlaneView {
    MaskedDepth readings;
    const Camera* camera;
    const double* plane;            // unit normal and height along it
    const std::vector<double>& beside;  // px beyond both sides of a strand at which the surface is read
    double near_radii, sunk_radii;  // of the plane within which their median is of the plane; below it from which an axis is raised
};

// Samples along strands: (size, 3) positions, unit axes across the line of sight and away from the sensor.
struct SampleAxes {
    Index size;
    const double *positions, *lateral, *behind;
};

// Move the measured axes (size, 3) that are lower than a radius over the plane against `behind`.
void raise_to_plane(const SampleAxes& samples, const std::vector<double>& radius, const PlaneView& view, std::vector<double>& target);
