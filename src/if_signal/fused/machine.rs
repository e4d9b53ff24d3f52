//! The instructions of the processor at hand, chosen when work begins: one program runs on a whole family of processors.

/// Loops over [`super::lanes`], which the compiler turns into SIMD.
///
/// All that [`Work::run`] calls must be inlined into it (`#[inline(always)]`): what is not is compiled for the oldest processor.
pub trait Work {
    type Out;

    /// `FUSED`: whether a·b + c is one instruction; elsewhere `mul_add` would be a slow call.
    fn run<const FUSED: bool>(self) -> Self::Out;
}

/// Whether every processor that this is compiled for has it. NEON has.
const FUSED: bool = cfg!(any(target_feature = "fma", target_arch = "aarch64"));

/// Does the work with the widest vectors there are: AVX-512, AVX2 with FMA, or those that every processor of the family has
/// (SSE2, NEON).
pub fn widest<W: Work>(work: W) -> W::Out {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("fma")
        {
            // SAFETY: the processor has these.
            return unsafe { avx512(work) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor has these.
            return unsafe { avx2(work) };
        }
    }
    work.run::<FUSED>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,fma")]
fn avx512<W: Work>(work: W) -> W::Out {
    work.run::<true>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<W: Work>(work: W) -> W::Out {
    work.run::<true>()
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{LANES, Lanes, cis, fma};
    use super::*;

    struct Turn(Lanes);

    impl Work for Turn {
        type Out = (Lanes, bool);

        #[inline(always)]
        fn run<const FUSED: bool>(self) -> (Lanes, bool) {
            let (cos, sin) = cis::<FUSED>(self.0);
            (fma::<FUSED>(cos, cos, fma::<FUSED>(sin, sin, [0.0; LANES])), FUSED)
        }
    }

    #[test]
    fn all_instructions_agree() {
        let turns = || Turn(std::array::from_fn(|lane| lane as f32 * 0.37 - 2.9));
        let plain = turns().run::<false>().0;
        let (wide, _) = widest(turns());
        for (a, b) in plain.iter().zip(wide) {
            assert!((a - 1.0).abs() < 1e-6 && (a - b).abs() < 1e-6, "{a} against {b}");
        }
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn a_processor_with_fma_uses_it() {
        assert_eq!(widest(Turn([0.0; LANES])).1, is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"));
    }
}
