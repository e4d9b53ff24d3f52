//! The library without the program: a new motion through the trained model that ships here, one frame of IF samples,
//! and the strongest moving cell of its range-Doppler map.
//!
//! `cargo run --release --example new_motion`

use hybridsim::{
    Result,
    evaluation::Simulation,
    heatmap::{Analysis, Samples, StaticRemoval, remove_static},
    person::{
        Person,
        actions::{self, Action, StyleConfig},
        procedural,
    },
    simulator::Scene,
    training::checkpoint,
};

fn main() -> Result<()> {
    let device = hybridsim::cli::device("auto")?;
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models/quickstart");
    let (simulator, state) = checkpoint::open(&folder, &device)?;

    // Another person than the one that was trained on, doing something else.
    let model = procedural::person(&procedural::subject("s3")?)?;
    let motion = actions::motion(Action::WalkClockwise, &StyleConfig::default(), &model, &[], 2.0, 60.0)?;
    let person = Person::Skinned { model, motion, placement: actions::placement(1.0, 3.0) };

    let radar = &state.site.radar;
    let scene = Scene::new(radar, state.site.room.as_ref(), Some(&person), &state.simulator)?;
    let samples = Simulation::new(&simulator, &scene, 1, true).frame(5)?;

    let [_, tx, rx, loops, length] = radar.dims();
    let moving = remove_static(Samples::new(&samples, [1, tx, rx, loops, length]), StaticRemoval::Loops);
    let map = Analysis::new(radar, &state.heatmap).range_doppler(&moving);
    let [row, column] = map.peak();
    println!("{} samples; strongest at {:.2} m, {:+.2} m/s", samples.len(), map.columns.values[column], map.rows.values[row]);
    Ok(())
}
