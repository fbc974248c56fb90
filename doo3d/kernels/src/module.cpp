#include "arrays.h"

// Return the digest of the sources of all kernels: `backend/docstrings.py` makes it.
const char* sources_digest();

void bind_appearance(Module&);
void bind_axes_in_mask(Module&);
void bind_color_bands(Module&);
void bind_cross_sections(Module&);
void bind_crossing_strands(Module&);
void bind_depth_support(Module&);
void bind_end_tangents(Module&);
void bind_equal_chords(Module&);
void bind_follow_strand(Module&);
void bind_frame_facts(Module&);
void bind_gap_path(Module&);
void bind_hidden_parts(Module&);
void bind_line_fitting(Module&);
void bind_mask_edge(Module&);
void bind_mask_parts(Module&);
void bind_nearest(Module&);
void bind_plane(Module&);
void bind_ribbon_tracing(Module&);
void bind_ribbons(Module&);
void bind_seen_gaps(Module&);
void bind_segment_fitting(Module&);
void bind_segment_lengths(Module&);
void bind_silhouette(Module&);
void bind_skeleton_graph(Module&);
void bind_skeleton_paths(Module&);
void bind_strand_cuts(Module&);
void bind_strand_depth(Module&);
void bind_strand_places(Module&);
void bind_strand_sides(Module&);
void bind_strokes(Module&);
void bind_surface_ahead(Module&);
void bind_surface_beside(Module&);
void bind_thinning(Module&);
void bind_valleys(Module&);
void bind_view_alignment(Module&);
void bind_visits(Module&);
void bind_whittaker(Module&);
void bind_zhang_suen(Module&);

// Hot loops on plain arrays, native. Every function is checked in a test against a slow plain reference.
NB_MODULE(_native, native) {
    Module m(native);
    m.attr("__sources__") = sources_digest();
    bind_appearance(m);
    bind_axes_in_mask(m);
    bind_color_bands(m);
    bind_cross_sections(m);
    bind_crossing_strands(m);
    bind_depth_support(m);
    bind_end_tangents(m);
    bind_equal_chords(m);
    bind_follow_strand(m);
    bind_frame_facts(m);
    bind_gap_path(m);
    bind_hidden_parts(m);
    bind_line_fitting(m);
    bind_mask_edge(m);
    bind_mask_parts(m);
    bind_nearest(m);
    bind_plane(m);
    bind_ribbon_tracing(m);
    bind_ribbons(m);
    bind_seen_gaps(m);
    bind_segment_fitting(m);
    bind_segment_lengths(m);
    bind_silhouette(m);
    bind_skeleton_graph(m);
    bind_skeleton_paths(m);
    bind_strand_cuts(m);
    bind_strand_depth(m);
    bind_strand_places(m);
    bind_strand_sides(m);
    bind_strokes(m);
    bind_surface_ahead(m);
    bind_surface_beside(m);
    bind_thinning(m);
    bind_valleys(m);
    bind_view_alignment(m);
    bind_visits(m);
    bind_whittaker(m);
    bind_zhang_suen(m);
}
