#include "arrays.h"

// Return the digest of the sources of all kernels: `backend/docstrings.py` makes it.
const char* sources_digest();

using Bind = void(Module&);
Bind bind_appearance, bind_axes_in_mask, bind_circle_fitting, bind_color_bands, bind_cross_sections, bind_crossing_strands, bind_depth_beside, bind_depth_support,
    bind_end_tangents, bind_equal_chords, bind_follow_strand, bind_frame_facts, bind_gap_path,
    bind_line_fitting, bind_mask_edge, bind_mask_parts, bind_nearest, bind_plane, bind_ribbon_tracing, bind_ribbons,
    bind_section_axes, bind_seen_gaps, bind_segment_fitting, bind_segment_lengths, bind_silhouette, bind_skeleton_graph, bind_skeleton_paths,
    bind_spurs, bind_strand_cuts, bind_strand_depth, bind_strand_places, bind_strand_sides, bind_strokes, bind_surface_ahead,
    bind_surface_beside, bind_thinning, bind_valleys, bind_visits, bind_whittaker, bind_zhang_suen;

// Hot loops on plain arrays, native. Every function is checked in a test against a slow plain reference.
NB_MODULE(_native, native) {
    Module m(native);
    m.attr("__sources__") = sources_digest();
    constexpr Bind* kernels[] = {
        bind_appearance, bind_axes_in_mask, bind_circle_fitting, bind_color_bands, bind_cross_sections, bind_crossing_strands, bind_depth_beside, bind_depth_support,
        bind_end_tangents, bind_equal_chords, bind_follow_strand, bind_frame_facts, bind_gap_path,
        bind_line_fitting, bind_mask_edge, bind_mask_parts, bind_nearest, bind_plane, bind_ribbon_tracing, bind_ribbons,
        bind_section_axes, bind_seen_gaps, bind_segment_fitting, bind_segment_lengths, bind_silhouette, bind_skeleton_graph, bind_skeleton_paths,
        bind_spurs, bind_strand_cuts, bind_strand_depth, bind_strand_places, bind_strand_sides, bind_strokes, bind_surface_ahead,
        bind_surface_beside, bind_thinning, bind_valleys, bind_visits, bind_whittaker, bind_zhang_suen,
    };
    for (Bind* bind : kernels) bind(m);
}
