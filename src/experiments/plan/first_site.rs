//! The comparison: simulation, scores and recognition of every method, on the first site.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::{Method, MethodStages, Place, Planner, Trained};
use crate::experiments::config::{BaselineName, Protocol};
use crate::experiments::takes::Take;
use crate::experiments::variants::Variant;

/// Stages that simulate, and what they simulate.
type Simulated<'a> = Vec<(usize, &'a Take)>;

impl Planner<'_> {
    pub(super) fn methods(&mut self, place: &Place, trained: &BTreeMap<Variant, Trained>) {
        let mut methods = self.compared();
        let [mut again, mut other_mesh] = [MethodStages::default(), MethodStages::default()];
        let simulations = self.simulations(place, trained, &mut methods, [&mut again, &mut other_mesh]);
        for ((method, stages), simulated) in methods.iter_mut().zip(&simulations) {
            self.recognitions(*method, stages, place, simulated);
        }
        self.recognitions_again(&mut again, place);
        self.plan.methods.extend(methods);
        if let Some(stage) = place.other_mesh {
            self.recognition_of_other_mesh(&mut other_mesh, stage, place);
            self.plan.methods.push((Method::OtherMesh, other_mesh));
        }
        self.plan.methods.push((Method::Again, again));
    }

    /// Baselines, then variants.
    fn compared(&self) -> Vec<(Method, MethodStages)> {
        let config = self.config;
        let rules: &[fn(BaselineName) -> Method] =
            if config.receiver_noise { &[Method::Baseline, Method::ReceiverNoise] } else { &[Method::Baseline] };
        let baselines = config.baselines.iter().flat_map(|&name| rules.iter().map(move |rule| rule(name)));
        baselines
            .chain(config.variants.iter().map(|&variant| Method::Variant(variant)))
            .map(|method| (method, MethodStages::default()))
            .collect()
    }

    /// Simulations and scores of all methods, recording by recording; what was recorded again is scored beside them.
    fn simulations<'a>(
        &mut self,
        place: &'a Place,
        trained: &BTreeMap<Variant, Trained>,
        methods: &mut [(Method, MethodStages)],
        [again, other_mesh]: [&mut MethodStages; 2],
    ) -> Vec<Simulated<'a>> {
        let config = self.config;
        // Everybody is needed where the classifier learns from others.
        let everybody = config.protocols.contains(&Protocol::OtherSubjects);
        let compared = |take: &Take| take.subject == config.split.training || take.subject == config.split.unseen;
        let mut simulations: Vec<Simulated> = vec![vec![]; methods.len()];
        for take in &place.takes {
            let additional = self.is_additional(take);
            if !(everybody || compared(take) || additional) {
                continue;
            }
            for ((method, stages), simulations) in methods.iter_mut().zip(&mut simulations) {
                if !everybody && additional && *method != Method::Variant(Variant::Ours) {
                    continue;
                }
                let simulate = self.simulation(*method, stages, place, take, trained);
                stages.simulate.push(simulate);
                simulations.push((simulate, take));
                let simulated = self.folder(simulate).join("recording");
                self.scores(stages, *method, place, take, simulate, simulated);
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

    fn simulation(
        &mut self,
        method: Method,
        stages: &mut MethodStages,
        place: &Place,
        take: &Take,
        trained: &BTreeMap<Variant, Trained>,
    ) -> usize {
        let ours = &trained[&Variant::Ours];
        match method {
            Method::Variant(variant) => {
                stages.train = Some(trained[&variant].stage);
                self.simulate(method, place, take, &trained[&variant])
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
    fn recognitions(&mut self, method: Method, stages: &mut MethodStages, place: &Place, simulated: &Simulated<'_>) {
        let config = self.config;
        let unseen = &config.split.unseen;
        let (tested, second): (Vec<&Take>, _) = (place.of_subject(unseen).collect(), self.additional(place));
        if method == Method::Variant(Variant::Ours) && self.recognises(&second) {
            let learned: Vec<usize> =
                simulated.iter().filter(|(_, take)| self.is_additional(take)).map(|&(stage, _)| stage).collect();
            let folders = learned.iter().map(|&stage| self.folder(stage).join("recording")).collect();
            let id = format!("{}_additional", method.id());
            stages.additional_recognition = Some(self.recognition(id, Protocol::SameMotions, place, &second, learned, folders));
        }
        for &protocol in &config.protocols {
            let learned: Vec<usize> = simulated
                .iter()
                .filter(|(_, take)| (take.subject == *unseen) == (protocol == Protocol::SameMotions))
                .map(|&(stage, _)| stage)
                .collect();
            let folders = learned.iter().map(|&stage| self.folder(stage).join("recording")).collect();
            let stage = self.recognition(method.id(), protocol, place, &tested, learned, folders);
            stages.recognition.insert(protocol, stage);
        }
    }

    /// Trained on what was measured: how well it could go.
    fn recognitions_again(&mut self, again: &mut MethodStages, place: &Place) {
        let config = self.config;
        let unseen = &config.split.unseen;
        let (tested, second): (Vec<&Take>, _) = (place.of_subject(unseen).collect(), self.additional(place));
        for &protocol in &config.protocols {
            let folders: Option<Vec<PathBuf>> = match protocol {
                Protocol::SameMotions => {
                    let recorded = place.again.subjects.contains(unseen);
                    recorded.then(|| place.of_subject(unseen).map(|take| place.again.folder.join(&take.name)).collect())
                }
                Protocol::OtherSubjects => {
                    let others = place.takes.iter().filter(|take| take.subject != *unseen);
                    Some(others.map(|take| place.recordings.join(&take.name)).collect())
                }
            };
            if let Some(folders) = folders {
                let stage = self.recognition("again".into(), protocol, place, &tested, vec![], folders);
                again.recognition.insert(protocol, stage);
            }
        }
        if self.recognises(&second) && second.iter().all(|take| place.again.subjects.contains(&take.subject)) {
            let folders = second.iter().map(|take| place.again.folder.join(&take.name)).collect();
            let id = "again_additional".into();
            again.additional_recognition = Some(self.recognition(id, Protocol::SameMotions, place, &second, vec![], folders));
        }
    }

    fn recognition_of_other_mesh(&mut self, other_mesh: &mut MethodStages, stage: usize, place: &Place) {
        if self.config.protocols.contains(&Protocol::SameMotions) {
            let tested: Vec<&Take> = place.of_subject(&self.config.split.unseen).collect();
            let recorded = self.folder(stage).join("recordings");
            let folders = tested.iter().map(|take| recorded.join(&take.name)).collect();
            let id = Method::OtherMesh.id();
            let learned = self.recognition(id, Protocol::SameMotions, place, &tested, vec![stage], folders);
            other_mesh.recognition.insert(Protocol::SameMotions, learned);
        }
    }
}
