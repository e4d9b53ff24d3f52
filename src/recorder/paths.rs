//! All paths of one radar: the body's, as far as there is one, and the surroundings'.

use num_complex::Complex64;

use super::amplitude::{Laws, WallLaw};
use super::body::{MovingBody, smooth_field};
use super::draws::Draw;
use super::effects::{Shadow, StaticReflector};
use super::mirror::Mirror;
use super::physiology::Physiology;
use super::scatter::Scatter;
use super::signal::Signal;
use super::stages::{MirrorPlan, Stages, vibration};
use super::surface::elements;
use super::surroundings::Surroundings;
use super::vector::Vector;
use super::visibility::Obstacle;
use super::world::World;
use crate::error::Result;
use crate::person::Person;
use crate::radar::Radar;

/// Reflection laws of a world.
pub fn laws(world: &World) -> Laws {
    let pattern = world.effects.antenna_pattern.as_ref().map(|pattern| pattern.exponent);
    Laws {
        body: world.skin,
        walls: world.walls.image_coefficient.map_or(WallLaw::Fresnel(world.walls.material), WallLaw::Constant),
        wall_coefficients: MirrorPlan::new(world).coefficients,
        antenna_exponent: pattern.unwrap_or(world.antenna_exponent),
    }
}

/// What the body's surface does beside its motion; `rest` is the rest pose, `[vertex, xyz]`.
fn physiology(world: &World, person: &Person, rest: &[Vector]) -> Result<Physiology> {
    let (effects, draws) = (&world.effects, world.draws());
    let mut swells = vec![];
    if let Some(breathing) = &effects.breathing {
        swells.push(breathing.swell(&draws, person)?);
    }
    if let Some(heartbeat) = &effects.heartbeat {
        swells.push(heartbeat.swell(&draws, person, rest)?);
    }
    Ok(Physiology { swells, stands: effects.pose_offset.as_ref().map(|pose| pose.stands()) })
}

/// The body in front of the true `radar`; its signals have the stages' guard samples.
pub fn body_scatter(world: &World, stages: &Stages, radar: &Radar) -> Result<Option<Scatter>> {
    let Some(person) = &world.person else { return Ok(None) };
    let mut body = MovingBody::new(person, world.interpolation)?;
    body.displace(world.mesh_error_m, &mut world.random(Draw::MeshError));
    body.physiology = physiology(world, person, body.rest())?;
    let surface = &world.surface;
    let mut reflectivity = smooth_field(body.rest(), surface.variation_scale_m, &mut world.random(Draw::Reflectivity));
    reflectivity.iter_mut().for_each(|db| *db *= surface.variation_db);
    if let Some(part) = &world.effects.part_reflectivity {
        reflectivity.iter_mut().zip(part.added_db(person)?).for_each(|(db, part)| *db += part);
    }
    let mut elements = elements(body.rest(), &body.faces, &reflectivity, surface, &mut world.random(Draw::Elements));
    if let Some(cloth) = &world.effects.clothing_delay {
        let garment = cloth.extra_m(person)?;
        for element in &mut elements {
            let corners = body.faces[element.face as usize].map(|vertex| garment[vertex]);
            element.extra_m = (0..3).map(|corner| element.point[corner] * corners[corner]).sum();
        }
    }
    let mirrors = MirrorPlan::new(world);
    let mut scatter = Scatter::new(radar, stages.guard(), body, elements, surface.smoothing, laws(world));
    scatter.mirrors = Mirror::images(&world.room, &mirrors.walls, mirrors.on_a_leg);
    scatter.order = mirrors.together;
    scatter.limits = mirrors.limits;
    scatter.clock = stages.clock;
    scatter.vibration = vibration(world);
    Ok(Some(scatter))
}

/// Body and surroundings of one radar.
pub struct Paths {
    pub scatter: Option<Scatter>,
    pub surroundings: Surroundings,
    shadow_width: Option<f64>,
}

impl Paths {
    /// `wide` is the radar of `scatter` with its guard samples; `level` what static reflectors are relative to.
    pub fn new(world: &World, scatter: Option<Scatter>, wide: &Radar, level: f64) -> Result<Self> {
        let point = |still: &StaticReflector| still.point(world.radar.centre_m(), level);
        let points: Vec<_> = world.effects.static_reflector.iter().map(point).collect();
        let surroundings = Surroundings::new(world, wide, &laws(world), &points)?;
        let shadow_width = world.effects.soft_occlusion.as_ref().map(|shadow| shadow.width);
        Ok(Self { scatter, surroundings, shadow_width })
    }

    /// The body's return in the first `loops` (one or all) of a frame, wide.
    pub fn body(&self, frame: usize, wide: &Radar, loops: usize) -> Result<Signal> {
        let mut signal = Signal::zero(frame, wide, loops);
        if let Some(scatter) = &self.scatter {
            signal.values = body_values(scatter, frame, loops)?;
        }
        Ok(signal)
    }

    /// Adds what stands around, with the body's shadow on it.
    pub fn add_surroundings(&self, stages: &Stages, signal: &mut Signal) -> Result<()> {
        let shadows = match (&self.scatter, self.shadow_width) {
            (Some(scatter), Some(width)) => {
                let last = if signal.loops > 1 { signal.loops } else { 0 };
                let first = self.shadowed(scatter, stages, signal.frame, 0, width)?;
                let last = if last == 0 { first.clone() } else { self.shadowed(scatter, stages, signal.frame, last, width)? };
                Some([first, last])
            }
            _ => None,
        };
        self.surroundings.add(&stages.clock, shadows.as_ref(), signal);
        Ok(())
    }

    fn shadowed(&self, scatter: &Scatter, stages: &Stages, frame: usize, index: usize, width: f64) -> Result<Vec<Complex64>> {
        // The last loop's end may lie a chirp beyond the motion.
        let index = index.min(stages.radar.loops_per_frame - 1);
        let pose = scatter.pose(stages.clock.ramp_s(&stages.radar, frame, 0, index))?;
        let obstacle = Obstacle::new(&pose, &scatter.body.faces, 0.0)?;
        let shadow = Shadow::new(&obstacle, &pose.vertices, stages.radar.centre_m(), stages.radar.wavelength_m(), width);
        Ok(self.surroundings.shadowed(&shadow))
    }
}

/// `[tx, rx, loop, sample]` of the first loop or of all.
pub fn body_values(scatter: &Scatter, frame: usize, loops: usize) -> Result<Vec<Complex64>> {
    if loops == 1 && scatter.radar.loops_per_frame > 1 { scatter.first_loop(frame) } else { scatter.frame(frame) }
}
