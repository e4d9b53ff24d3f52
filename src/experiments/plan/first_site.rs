//! The comparison: simulation, scores and recognition of every method, on the first site.

use super::stages::{Learned, Simulation};
use super::{Drawn, Method, MethodStages, Place, Planner, Trainings};
use crate::error::Result;
use crate::experiments::config::{BaselineName, Protocol};
use crate::experiments::takes::Take;
use crate::experiments::variants::Variant;

/// Stages that simulate, and what they simulate.
pub(super) type Simulated<'a> = Vec<(usize, &'a Take)>;

impl Planner<'_> {
    pub(super) fn methods(&mut self, place: &Place, trained: &Trainings) -> Result<()> {
        let mut methods = self.compared();
        let [mut again, mut other_mesh] = [MethodStages::default(), MethodStages::default()];
        let simulations = self.simulations(place, trained, &mut methods, [&mut again, &mut other_mesh]);
        for ((drawn, stages), simulated) in methods.iter_mut().zip(&simulations) {
            self.recognitions(*drawn, stages, place, simulated);
        }
        self.recognitions_again(&mut again, place);
        let drawn: Vec<(Drawn, &Simulated)> = methods.iter().map(|(drawn, _)| *drawn).zip(&simulations).collect();
        self.few(place, &drawn)?;
        for (drawn, stages) in methods {
            match self.plan.methods.iter_mut().find(|(method, _)| *method == drawn.method) {
                Some((_, draws)) => draws.push(stages),
                None => self.plan.methods.push((drawn.method, vec![stages])),
            }
        }
        if let Some(stage) = place.other_mesh {
            self.recognition_of_other_mesh(&mut other_mesh, stage, place);
            self.plan.methods.push((Method::OtherMesh, vec![other_mesh]));
        }
        self.plan.methods.push((Method::Again, vec![again]));
        Ok(())
    }

    /// Baselines, then variants, then the variants' further draws.
    fn compared(&self) -> Vec<(Drawn, MethodStages)> {
        let config = self.config;
        let rules: &[fn(BaselineName) -> Method] =
            if config.receiver_noise { &[Method::Baseline, Method::ReceiverNoise] } else { &[Method::Baseline] };
        let baselines = config.baselines.iter().flat_map(|&name| rules.iter().map(move |rule| Drawn::first(rule(name))));
        let of_draw = |draw| config.variants.iter().map(move |&variant| Drawn { method: Method::Variant(variant), draw });
        let variants = (0..config.seeds).flat_map(of_draw);
        baselines.chain(variants).map(|drawn| (drawn, MethodStages::default())).collect()
    }

    /// Simulations and scores of all methods, recording by recording; what was recorded again is scored beside them.
    fn simulations<'a>(
        &mut self,
        place: &'a Place,
        trained: &Trainings,
        methods: &mut [(Drawn, MethodStages)],
        [again, other_mesh]: [&mut MethodStages; 2],
    ) -> Vec<Simulated<'a>> {
        let mut simulations: Vec<Simulated> = vec![vec![]; methods.len()];
        for take in &place.takes {
            let additional = self.is_additional(take);
            for ((drawn, stages), simulations) in methods.iter_mut().zip(&mut simulations) {
                if !self.is_simulated(*drawn, take) {
                    continue;
                }
                let simulation = self.simulation(*drawn, stages, place, take, trained);
                if take.subject == self.config.split.training && !self.teaches(*drawn) {
                    self.held_out(stages, *drawn, place, take, simulation);
                    continue;
                }
                let simulate = self.kept(*drawn, place, take, simulation);
                stages.simulate.push(simulate);
                simulations.push((simulate, take));
                let simulated = self.folder(simulate).join("recording");
                self.scores(stages, *drawn, place, take, simulate, simulated);
            }
            if place.again.subjects.contains(&take.subject) {
                self.scores_again(again, Method::Again, place, take, place.again.folder.join(&take.name), None);
            }
            // Another mesh is recorded of the compared subjects alone.
            if let Some(stage) = place.other_mesh.filter(|_| !additional) {
                let recorded = self.folder(stage).join("recordings").join(&take.name);
                self.scores_again(other_mesh, Method::OtherMesh, place, take, recorded, Some(stage));
            }
        }
        simulations
    }

    /// Whether a classifier learns from the method's simulations of others than the unseen subject.
    fn teaches(&self, drawn: Drawn) -> bool {
        let config = self.config;
        config.protocols.contains(&Protocol::OtherSubjects)
            || config.few_measured.as_ref().is_some_and(|few| drawn.method == Method::Variant(few.simulated_by))
    }

    /// Whether the method is asked for this recording.
    fn is_simulated(&self, drawn: Drawn, take: &Take) -> bool {
        let compared = [&self.config.split.training, &self.config.split.unseen].contains(&&take.subject);
        let second = self.is_additional(take) && drawn == Drawn::first(Method::Variant(Variant::Ours));
        compared || second || self.teaches(drawn)
    }

    fn simulation(
        &mut self,
        drawn: Drawn,
        stages: &mut MethodStages,
        place: &Place,
        take: &Take,
        trained: &Trainings,
    ) -> Simulation {
        let ours = &trained[&Variant::Ours][0];
        match drawn.method {
            Method::Variant(variant) => {
                let trained = &trained[&variant][drawn.draw];
                stages.train = Some(trained.stage);
                self.simulation_by(drawn, place, take, trained)
            }
            Method::Baseline(name) => self.baseline(name, None, place, take, ours),
            Method::ReceiverNoise(name) => {
                let noise = self.noise_level(place);
                self.baseline(name, Some(noise), place, take, ours)
            }
            _ => unreachable!("the first site has baselines and variants"),
        }
    }

    /// The recordings of the additional unseen subject.
    fn additional<'a>(&self, place: &'a Place) -> Vec<&'a Take> {
        place.takes.iter().filter(|take| self.is_additional(take)).collect()
    }

    /// Whether a classifier is tested on the additional subject.
    fn recognises(&self, additional: &[&Take]) -> bool {
        !additional.is_empty() && self.config.protocols.contains(&Protocol::SameMotions)
    }

    /// What classifiers learn from a method's simulations.
    fn recognitions(&mut self, drawn: Drawn, stages: &mut MethodStages, place: &Place, simulated: &Simulated<'_>) {
        let config = self.config;
        let unseen = &config.split.unseen;
        let (tested, second): (Vec<&Take>, _) = (place.of_subject(unseen).collect(), self.additional(place));
        if drawn == Drawn::first(Method::Variant(Variant::Ours)) && self.recognises(&second) {
            let learned = self.simulated_by(0, simulated.iter().copied().filter(|(_, take)| self.is_additional(take)));
            let id = format!("{}_additional", drawn.id());
            stages.additional_recognition = Some(self.recognition(id, Protocol::SameMotions, place, &second, learned));
        }
        for &protocol in &config.protocols {
            let counts = |take: &Take| (take.subject == *unseen) == (protocol == Protocol::SameMotions);
            let learned = self.simulated_by(drawn.draw, simulated.iter().copied().filter(|(_, take)| counts(take)));
            let stage = self.recognition(drawn.id(), protocol, place, &tested, learned);
            stages.recognition.insert(protocol, stage);
        }
    }

    /// Trained on what was measured: how well it could go.
    fn recognitions_again(&mut self, again: &mut MethodStages, place: &Place) {
        let config = self.config;
        let unseen = &config.split.unseen;
        let (tested, second): (Vec<&Take>, _) = (place.of_subject(unseen).collect(), self.additional(place));
        for &protocol in &config.protocols {
            let learned = match protocol {
                Protocol::SameMotions => {
                    place.again.subjects.contains(unseen).then(|| Learned::recorded(&place.again.folder, &tested))
                }
                Protocol::OtherSubjects => Some(Learned::recorded(&place.recordings, &self.others(place))),
            };
            if let Some(learned) = learned {
                let stage = self.recognition("again".into(), protocol, place, &tested, learned);
                again.recognition.insert(protocol, stage);
            }
        }
        if self.recognises(&second) && second.iter().all(|take| place.again.subjects.contains(&take.subject)) {
            let learned = Learned::recorded(&place.again.folder, &second);
            let id = "again_additional".into();
            again.additional_recognition = Some(self.recognition(id, Protocol::SameMotions, place, &second, learned));
        }
    }

    /// The recordings of everybody but the unseen subject.
    pub(super) fn others<'a>(&self, place: &'a Place) -> Vec<&'a Take> {
        place.takes.iter().filter(|take| take.subject != self.config.split.unseen).collect()
    }

    fn recognition_of_other_mesh(&mut self, other_mesh: &mut MethodStages, stage: usize, place: &Place) {
        if self.config.protocols.contains(&Protocol::SameMotions) {
            let tested: Vec<&Take> = place.of_subject(&self.config.split.unseen).collect();
            let recorded = Learned::recorded(&self.folder(stage).join("recordings"), &tested);
            let learned = Learned { stages: vec![stage], ..recorded };
            let stage = self.recognition(Method::OtherMesh.id(), Protocol::SameMotions, place, &tested, learned);
            other_mesh.recognition.insert(Protocol::SameMotions, stage);
        }
    }
}
