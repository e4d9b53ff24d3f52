//! The table of differentiable stages: what each one's gradient flows to, whether it is smooth, and which test holds it
//! against central differences in f64 (a micrometre for positions). The tests sit beside their stages; this one sees
//! to it that none of them goes missing and that what has no gradient says why.

use std::path::Path;

enum Calculus {
    /// Differentiable everywhere, singular points included.
    Smooth,
    /// Differentiable but where stated.
    Broken(&'static str),
    /// Carries no gradient, for the reason given.
    Constant(&'static str),
}
use Calculus::{Broken, Constant, Smooth};

/// (stage, inputs, calculus, file, test)
const STAGES: &[(&str, &str, Calculus, &str, &str)] = &[
    ("tri-plane", "texels", Smooth, "features/triplane.rs", "gradients_to_the_texels_agree_with_central_differences"),
    ("gather and weighted sum", "table", Smooth, "features/rows.rs", "gradients_agree_with_central_differences"),
    ("periodic encoding", "position", Smooth, "features/encoding.rs", "gradients_agree_with_central_differences"),
    (
        "graph convolution",
        "features, layers, token",
        Smooth,
        "features/graph_tests.rs",
        "gradients_agree_with_central_differences",
    ),
    (
        "networks",
        "input, weights, biases",
        Smooth,
        "features/mlp.rs",
        "gradients_to_the_input_and_every_parameter_agree_with_central_differences",
    ),
    (
        "decoders and gain",
        "features, gain",
        Smooth,
        "scatterers/decoders.rs",
        "gradients_to_the_features_and_the_gain_agree_with_central_differences",
    ),
    ("material ranges", "raw parameters", Smooth, "scatterers/material.rs", "gradients_agree_with_central_differences"),
    ("Fresnel", "cosine, η, k", Smooth, "scatterers/fresnel.rs", "gradients_agree_with_central_differences"),
    (
        "microfacet amplitude",
        "material, normal, directions",
        Smooth,
        "scatterers/microfacet_tests.rs",
        "gradients_to_every_input_agree_with_central_differences",
    ),
    (
        "tangent frame",
        "normal, reference",
        Broken("the frame from a normal alone jumps where n_z changes sign"),
        "scatterers/tangent.rs",
        "gradients_agree_with_central_differences",
    ),
    (
        "spherical harmonics",
        "weights, direction",
        Smooth,
        "scatterers/spherical_harmonics.rs",
        "gradients_agree_with_central_differences",
    ),
    (
        "Gaussian patches",
        "patch, frame, directions",
        Smooth,
        "scatterers/patches_tests.rs",
        "gradients_to_every_input_agree_with_central_differences",
    ),
    ("skinning", "pose, shape, translation", Smooth, "body/tensors.rs", "gradients_reach_pose_shape_and_translation"),
    (
        "posed frame: positions, facets, normals, areas",
        "clock, heading, shift, shape, turns and shifts between knots",
        Broken("a facet or vertex without area has a fixed normal; who is seen is constant"),
        "body/posing/tests.rs",
        "gradients_of_positions_normals_and_areas_agree_with_central_differences_for_every_kind_of_parameter",
    ),
    (
        "canonical offset through skinning",
        "offset",
        Smooth,
        "body/tests.rs",
        "a_canonical_offset_turns_with_the_body_and_carries_a_gradient",
    ),
    (
        "facet integral",
        "edges, wavevector",
        Smooth,
        "body/facets.rs",
        "gradients_equal_central_differences_also_where_corners_coincide",
    ),
    (
        "legs and phasors",
        "displacement, amplitude",
        Smooth,
        "paths/tests.rs",
        "gradients_of_phasors_agree_with_central_differences",
    ),
    (
        "coherent sum, every form",
        "amplitude, phase, sweep",
        Smooth,
        "if_signal/tests.rs",
        "gradients_agree_with_central_differences_in_f64",
    ),
    (
        "direct and indirect signal",
        "displacement, amplitude",
        Smooth,
        "if_signal/signals_tests.rs",
        "gradients_agree_with_central_differences_of_a_micrometre",
    ),
    ("noise", "signal, rate", Smooth, "if_signal/noise.rs", "gradients_flow_to_the_rate_and_to_the_signal"),
    (
        "range-Doppler and decibels",
        "signal",
        Smooth,
        "heatmap/dft_tests.rs",
        "gradients_of_the_decibel_map_agree_with_central_differences",
    ),
    (
        "loss",
        "simulated signal",
        Broken("at clamp_db, below which it is zero, if that is set"),
        "loss.rs",
        "gradients_agree_with_central_differences_for_every_setting",
    ),
    (
        "effects on the signal",
        "signal, values",
        Broken("clipping is passed straight through; a low-pass corner of zero stands for none; lots carry no gradient"),
        "effects/tests.rs",
        "gradients_of_every_operator_on_the_signal_agree_with_central_differences",
    ),
    ("effects on points", "values", Smooth, "effects/point_tests.rs", "effects_on_points_are_neutral_and_differentiable"),
    ("effects on paths", "values", Smooth, "effects/point_tests.rs", "effects_on_paths_are_differentiable"),
    (
        "effects on noise",
        "values",
        Broken("the probability of impulses decides by lot"),
        "effects/point_tests.rs",
        "noise_is_neutral_differentiable_and_has_the_spectrum_or_tails_or_coherence_asked_for",
    ),
    (
        "visibility",
        "positions",
        Constant("a point is seen or not; its hull has no useful derivative"),
        "scatterers/visibility.rs",
        "agreement",
    ),
];

#[test]
fn every_stage_has_its_gradient_test() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut missing = Vec::new();
    for (stage, inputs, calculus, file, test) in STAGES {
        let text = std::fs::read_to_string(root.join(file)).unwrap_or_default();
        let found = text.contains(&format!("fn {test}("));
        let says_why = match calculus {
            Smooth => true,
            Broken(reason) | Constant(reason) => !reason.is_empty(),
        };
        if !(found && says_why) {
            missing.push(format!("{stage} ({inputs}): {file} has no test `{test}`"));
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}
