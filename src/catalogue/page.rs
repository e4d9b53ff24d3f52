//! One effect in Markdown.

use std::fmt::Write as _;

use super::{ORIGIN, Signature, heading};
use crate::diagnosis::report::never_detectable;
use crate::effects::{EffectInfo, EffectSetting, ParameterInfo, look_alikes};

/// To the page of an effect, from another page.
pub(super) fn link(id: &str) -> String {
    format!("[`{id}`]({id}.md)")
}

/// The page; the picture lies beside it.
pub(super) fn markdown(info: &EffectInfo, signature: Option<&Signature>) -> String {
    let mut text = format!(
        "{ORIGIN}\n# {}: {}\n\n{}\n\nStage: {}.{} Term of the IF signal:\n\n```text\n{}\n```\n",
        info.id,
        info.title,
        info.explanation,
        heading(info.stage).to_lowercase(),
        if info.needs_person { " A recording without a person cannot have it." } else { "" },
        info.equation
    );
    text.push_str("\n| parameter | unit | neutral or start | prior |\n|---|---|---|---|\n");
    for parameter in info.parameters {
        let ParameterInfo { name, unit, neutral, least, most, .. } = parameter;
        let _ = writeln!(text, "| `{name}` | {unit} | {neutral} | {least} to {most} |");
    }
    if let Some(signature) = signature {
        let _ = write!(text, "\n## Signature\n\n![{}]({}.png)\n\n{}\n", info.title, info.id, signature.caption());
    }
    text.push_str("\n## Look-alikes\n\n");
    for other in look_alikes(info) {
        let _ = writeln!(text, "- {}: {}", link(other.id), other.title);
    }
    let _ = write!(text, "\nTo separate them: {}.\n", info.separate_by.trim_end_matches('.'));
    if let Some(never) = never_detectable(true).into_iter().find(|never| never.id == info.id) {
        let _ = write!(text, "\n## Not estimable\n\nThe diagnosis never names it: {}.\n", never.reason);
    }
    let setting = signature.map_or_else(|| EffectSetting::neutral(info.id), |signature| signature.setting(info));
    let _ = write!(text, "\n## In a config\n\n```toml\n{}```\n", in_config(&setting));
    text
}

fn in_config(setting: &EffectSetting) -> String {
    let mut text = format!("[[simulator.effects]]\nid = {:?}\n", setting.id);
    if let Some(choice) = &setting.choice {
        let _ = writeln!(text, "choice = {choice:?}");
    }
    if !setting.parameters.is_empty() {
        let given: Vec<String> = setting.parameters.iter().map(|(name, values)| format!("{name} = {values:?}")).collect();
        let _ = writeln!(text, "parameters = {{ {} }}", given.join(", "));
    }
    text
}
