//! The table of differentiable stages: what each one's gradient flows to, whether it is smooth, and the test that holds it
//! against central differences in f64 (a micrometre for positions). The table runs what it lists: a row is a test, so a
//! function that is missing does not compile, and one that compares nothing, or only derivatives that are zero, fails.
//!
//! To register a stage: write its test as `pub(crate) fn` beside the stage and add a row.

use crate::support::with_evidence;

/// Where a stage has a derivative.
#[allow(dead_code, reason = "read by people, and checked when the table is compiled")]
enum Calculus {
    /// Everywhere, singular points included.
    Smooth,
    /// But where stated.
    Broken(&'static str),
}
use Calculus::{Broken, Smooth};

macro_rules! stages {
    ($($name:ident: $stage:literal, $inputs:literal, $calculus:expr, $test:path;)*) => {
        $(
            const _: () = assert!(match $calculus {
                Smooth => true,
                Broken(reason) => !reason.is_empty(),
            });

            #[doc = concat!($stage, ": to ", $inputs)]
            #[test]
            fn $name() {
                with_evidence($test);
            }
        )*
    };
}

/// Stages without a gradient, each with the reason.
macro_rules! constants {
    ($($stage:literal, $inputs:literal, $reason:literal;)*) => { $(const _: () = assert!(!$reason.is_empty());)* };
}

stages! {
    tri_plane:
        "tri-plane", "texels", Smooth,
        crate::features::triplane::tests::gradients_to_the_texels_agree_with_central_differences;
    gather_and_weighted_sum:
        "gather and weighted sum", "table", Smooth,
        crate::features::rows::tests::gradients_agree_with_central_differences;
    periodic_encoding:
        "periodic encoding", "position", Smooth,
        crate::features::encoding::tests::gradients_agree_with_central_differences;
    graph_convolution:
        "graph convolution", "features, layers, token", Smooth,
        crate::features::graph::tests::gradients_agree_with_central_differences;
    networks:
        "networks", "input, weights, biases", Smooth,
        crate::features::mlp::tests::gradients_to_the_input_and_every_parameter_agree_with_central_differences;
    decoders_and_gain:
        "decoders and gain", "features, gain", Smooth,
        crate::scatterers::decoders::tests::gradients_to_the_features_and_the_gain_agree_with_central_differences;
    material_ranges:
        "material ranges", "raw parameters", Smooth,
        crate::scatterers::material::tests::gradients_agree_with_central_differences;
    fresnel:
        "Fresnel", "cosine, η, k", Smooth,
        crate::scatterers::fresnel::tests::gradients_agree_with_central_differences;
    microfacet_amplitude:
        "microfacet amplitude", "material, normal, directions", Smooth,
        crate::scatterers::microfacet::tests::gradients_to_every_input_agree_with_central_differences;
    tangent_frame:
        "tangent frame", "normal, reference", Broken("the frame from a normal alone jumps where n_z changes sign"),
        crate::scatterers::tangent::tests::gradients_agree_with_central_differences;
    spherical_harmonics:
        "spherical harmonics", "weights, direction", Smooth,
        crate::scatterers::spherical_harmonics::tests::gradients_agree_with_central_differences;
    gaussian_patches:
        "Gaussian patches", "patch, frame, directions", Smooth,
        crate::scatterers::patches::tests::gradients_to_every_input_agree_with_central_differences;
    skinning:
        "skinning", "pose, shape, translation", Smooth,
        crate::body::tensors::tests::gradients_reach_pose_shape_and_translation;
    posed_frame:
        "posed frame: positions, facets, normals, areas",
        "clock, heading, shift, shape, turns and shifts between knots",
        Broken("a facet or vertex without area has a fixed normal; who is seen is constant"),
        crate::body::posing::tests::gradients_of_positions_normals_and_areas_agree_with_central_differences_for_every_kind_of_parameter;
    canonical_offset_through_skinning:
        "canonical offset through skinning", "offset", Smooth,
        crate::body::tests::a_canonical_offset_turns_with_the_body_and_carries_a_gradient;
    facet_integral:
        "facet integral", "edges, wavevector", Smooth,
        crate::body::facets::tests::gradients_equal_central_differences_also_where_corners_coincide;
    legs_and_phasors:
        "legs and phasors", "displacement, amplitude", Smooth,
        crate::paths::tests::gradients_of_phasors_agree_with_central_differences;
    coherent_sum_every_form:
        "coherent sum, every form", "amplitude, phase, sweep", Smooth,
        crate::if_signal::tests::gradients_agree_with_central_differences_in_f64;
    direct_and_indirect_signal:
        "direct and indirect signal", "displacement, amplitude", Smooth,
        crate::if_signal::signals::tests::gradients_agree_with_central_differences_of_a_micrometre;
    noise:
        "noise", "signal, rate", Smooth,
        crate::if_signal::noise::tests::gradients_flow_to_the_rate_and_to_the_signal;
    range_doppler_and_decibels:
        "range-Doppler and decibels", "signal", Smooth,
        crate::heatmap::dft::tests::gradients_of_the_decibel_map_agree_with_central_differences;
    loss:
        "loss", "simulated signal", Broken("at clamp_db, below which it is zero, if that is set"),
        crate::loss::tests::gradients_agree_with_central_differences_for_every_setting;
    effects_on_the_signal:
        "effects on the signal", "signal, values", Broken("clipping is passed straight through; a low-pass corner of zero stands for none; lots carry no gradient"),
        crate::effects::tests::gradients_of_every_operator_on_the_signal_agree_with_central_differences;
    effects_on_points:
        "effects on points", "values", Smooth,
        crate::effects::point_tests::effects_on_points_are_neutral_and_differentiable;
    effects_on_paths:
        "effects on paths", "values", Smooth,
        crate::effects::point_tests::effects_on_paths_are_differentiable;
    effects_on_noise:
        "effects on noise", "values", Broken("the probability of impulses decides by lot"),
        crate::effects::point_tests::noise_is_neutral_differentiable_and_has_the_spectrum_or_tails_or_coherence_asked_for;
}

constants! {
    "visibility", "positions", "a point is seen or not; its hull has no useful derivative";
}
