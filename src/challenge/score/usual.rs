//! What the usual measures show, on the scale of the nulls of a case's own structure: unlike frames and channels have unlike errors.

use std::collections::BTreeMap;

use super::Case;
use crate::challenge::baselines::quantile;
use crate::challenge::config::Stratum;
use crate::challenge::report::Measures;
use crate::challenge::rules::{NULL_BAND, OBVIOUS_D_PRIME};

/// Middle and spread of a value on the nulls of each structure.
pub(super) struct Scale(BTreeMap<String, [f64; 2]>);

impl Scale {
    /// Of a value of some cases, whose spread is at least `least`.
    pub fn of(cases: &[Case], value: impl Fn(&Case) -> Option<f64>, least: f64) -> Self {
        let mut nulls: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for case in cases.iter().filter(|case| case.is(Stratum::Null)) {
            nulls.entry(case.judgement.structure.clone()).or_default().extend(value(case));
        }
        let scale = |values: &[f64]| {
            let [low, centre, high] = [0.16, 0.5, 0.84].map(|part| quantile(values, part));
            [centre, (0.5 * (high - low)).max(least)]
        };
        Self(nulls.into_iter().filter(|(_, values)| !values.is_empty()).map(|(name, values)| (name, scale(&values))).collect())
    }

    /// How many spreads above the middle a case's value is; none where its structure has no nulls.
    pub fn place(&self, case: &Case, value: f64) -> Option<f64> {
        self.0.get(&case.judgement.structure).map(|[centre, spread]| (value - centre) / spread)
    }
}

/// Concealed: the trained simulator, or where none was trained the prediction, is as good as on the nulls by every usual measure, or a
/// return covers the effect. What nobody could detect is no proof of anything.
pub(super) fn mark_concealed(cases: &mut [Case]) {
    let usual: [fn(&Measures) -> Option<f64>; 3] = [|m| m.db_mse, |m| m.psnr_db, |m| m.ssim];
    let places: Vec<Vec<Option<f64>>> = usual
        .iter()
        .map(|measure| {
            let scale = Scale::of(cases, |case| measure(&case.before), f64::MIN_POSITIVE);
            cases.iter().map(|case| scale.place(case, measure(&case.before)?)).collect()
        })
        .collect();
    let band = |places: &Vec<Option<f64>>| {
        let nulls = cases.iter().zip(places).filter(|(case, _)| case.is(Stratum::Null)).filter_map(|(_, place)| *place);
        let nulls: Vec<f64> = nulls.collect();
        NULL_BAND.map(|part| quantile(&nulls, part))
    };
    let bands: Vec<[f64; 2]> = places.iter().map(band).collect();
    for (index, case) in cases.iter_mut().enumerate() {
        let inside = places.iter().zip(&bands).filter_map(|(places, [low, high])| Some((*low..=*high).contains(&places[index]?)));
        let inside: Vec<bool> = inside.collect();
        let absorbed = !inside.is_empty() && inside.iter().all(|&inside| inside);
        let masked = case.judgement.strength.is_some_and(|strength| strength.masked());
        case.concealed = case.planted() && case.d_prime() >= OBVIOUS_D_PRIME && (absorbed || masked);
    }
}
