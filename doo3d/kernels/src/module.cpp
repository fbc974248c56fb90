// The kernels as one Python module; each source file binds its own functions.
#include "arrays.h"

void bind_clearance(nb::module_&);
void bind_closing(nb::module_&);
void bind_color_bands(nb::module_&);
void bind_cross_sections(nb::module_&);
void bind_depth_filter(nb::module_&);
void bind_end_tangents(nb::module_&);
void bind_equal_chords(nb::module_&);
void bind_gap_path(nb::module_&);
void bind_mask_pixels(nb::module_&);
void bind_matching(nb::module_&);
void bind_medial_axis(nb::module_&);
void bind_nearest(nb::module_&);
void bind_plane(nb::module_&);
void bind_polyline(nb::module_&);
void bind_sampling(nb::module_&);
void bind_second_best(nb::module_&);
void bind_segment_fitting(nb::module_&);
void bind_segment_lengths(nb::module_&);
void bind_skeleton_graph(nb::module_&);
void bind_ribbons(nb::module_&);
void bind_small_regions(nb::module_&);
void bind_strokes(nb::module_&);
void bind_thinning(nb::module_&);
void bind_whittaker(nb::module_&);
void bind_zhang_suen(nb::module_&);

NB_MODULE(_native, m) {
    bind_clearance(m);
    bind_closing(m);
    bind_color_bands(m);
    bind_cross_sections(m);
    bind_depth_filter(m);
    bind_end_tangents(m);
    bind_equal_chords(m);
    bind_gap_path(m);
    bind_mask_pixels(m);
    bind_matching(m);
    bind_medial_axis(m);
    bind_nearest(m);
    bind_plane(m);
    bind_polyline(m);
    bind_sampling(m);
    bind_second_best(m);
    bind_segment_fitting(m);
    bind_segment_lengths(m);
    bind_skeleton_graph(m);
    bind_ribbons(m);
    bind_small_regions(m);
    bind_strokes(m);
    bind_thinning(m);
    bind_whittaker(m);
    bind_zhang_suen(m);
}
