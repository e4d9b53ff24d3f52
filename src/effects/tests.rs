use super::*;

#[test]
fn the_library_is_complete_and_consistent() {
    let order = [
        Stage::Timing,
        Stage::Scene,
        Stage::Body,
        Stage::Propagation,
        Stage::Waveform,
        Stage::Antenna,
        Stage::Receiver,
        Stage::Noise,
    ];
    let place = |info: &EffectInfo| order.iter().position(|stage| *stage == info.stage).unwrap();
    assert!(library().windows(2).all(|pair| place(pair[0]) <= place(pair[1])), "out of the signal's order");
    for effect in library() {
        assert!(std::ptr::eq(info(effect.id).unwrap(), *effect), "{} is there twice", effect.id);
        for other in effect.look_alikes {
            assert!(*other != effect.id && info(other).is_some(), "{} looks like {other}", effect.id);
        }
        for text in [effect.title, effect.explanation, effect.equation, effect.separate_by] {
            assert!(!text.is_empty(), "{}", effect.id);
        }
        for parameter in effect.parameters {
            assert!(parameter.least < parameter.most && parameter.neutral.is_finite(), "{}: {parameter:?}", effect.id);
        }
    }
    assert!(info("no_such_effect").is_none());
}
