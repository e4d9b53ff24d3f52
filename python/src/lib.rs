//! HybridSim for Python: the verbs of the program on arrays. The Python package around this module (`hybridsim/`) has the types,
//! the docs and what needs no Rust.
//!
//! Settings and reports cross as JSON, which is what the program's files hold; samples cross as buffers, without a copy.
//! A verb is one file of `verbs`, with its function listed here.

mod buffer;
mod errors;
mod notice;
mod verbs;
mod work;

#[pyo3::pymodule]
mod _hybridsim {
    #[pymodule_export]
    use crate::buffer::Numbers;
    #[pymodule_export]
    use crate::verbs::{
        align::align,
        challenge::{challenge_begin, challenge_run, challenge_score, challenge_seal, challenge_twins},
        check::check,
        diagnose::diagnose,
        export::export,
        heatmaps::heatmaps,
        import::import,
        read::{Recording, radar, read},
        record::record,
        reproduce::{reproduce, reproduce_stage, stages},
        simulate::simulate,
        site::{recordings_in, site, site_look},
        train::train,
    };
    #[pymodule_export]
    use crate::work::{abandon, is_library};
}
