//! What the fitted field of a candidate does, in the words of reports.

macro_rules! behaviours {
    ($($name:ident $words:literal;)*) => {
        /// What the fitted field of a candidate does.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Behaviour {
            $($name,)*
        }

        impl Behaviour {
            /// As `behaves_like` of a report says it.
            pub const fn words(self) -> &'static str {
                match self {
                    $(Self::$name => $words,)*
                }
            }
        }
    };
}

behaviours! {
    AdditiveFastTime "additive fast-time";
    SparseAdditive "sparse additive";
    Tone "tone";
    ExcessPower "excess power";
    FastTimeGain "fast-time gain";
    BeatFrequencyGain "beat-frequency gain";
    DelayProportionalPhase "delay-proportional phase";
    DelayProportionalPhaseByReceiver "delay-proportional phase by receiver";
    SlowTimeGain "slow-time gain";
    SlowTimePhase "slow-time phase";
    SlowTimeGainOfOneChannel "slow-time gain of one channel";
    SlowTimePatternOfOneReturn "slow-time pattern of one return";
    SlowTimeSettlingOfOneReturn "slow-time settling of one return";
    SingleFrame "single frame";
    FadingBehindTheBody "static returns that fade behind the body";
    ChangingAtOneRange "static returns that change at one range";
    Modulated "a static return that is modulated";
    NonLinear "non-linear";
    LinearInTheSignal "linear in the signal";
    Quadratic "quadratic in the signal";
    ConjugateImage "conjugate image";
    Amplitude "amplitude";
    ChannelGain "channel gain";
    CoupledOnOneSide "receivers that are coupled to the neighbour on one side";
    PhaseBetweenReceivers "phase between receivers that grows with the direction";
    DirectionOffset "direction offset";
    NoiseOverBeatFrequency "noise over beat frequency";
    NoiseSharedByReceivers "noise shared by receivers";
    Quantisation "quantisation";
    SlippedSamples "slipped samples";
    PathLike "path-like";
    PathLikeOverTheBody "path-like, over the body";
    ReturnOfOnePart "return of one part of the body";
    TimeOffset "time offset";
    RangeOffset "range offset";
}

impl Behaviour {
    /// Whether it is a return that neither the body nor static clutter explains.
    pub fn is_path(self) -> bool {
        matches!(self, Self::PathLike | Self::PathLikeOverTheBody)
    }
}
