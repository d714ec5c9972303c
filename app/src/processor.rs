//! Whether this processor knows the instructions that the program is made of.

/// What a processor is told that is older than what the program was compiled for.
pub(crate) const TOO_OLD: &str = "this processor has no AVX2, for which the program was compiled (x86-64-v3: Intel since 2013, AMD since 2015). \
Compile it for this machine: RUSTFLAGS=\"-C target-cpu=native\" cargo build --release";

/// Ends the program with one line where the processor is too old, instead of an illegal instruction
/// somewhere within the work.
#[inline(never)]
pub(crate) fn check() {
    if !is_known() {
        use std::io::Write;
        let mut out = std::io::stderr();
        for part in ["intrados: ", TOO_OLD, "\n"] {
            let _ = out.write_all(part.as_bytes());
        }
        std::process::exit(1);
    }
}

/// Whether the processor knows all instructions that may be asked of it.
///
/// `is_x86_feature_detected!` is a constant in a program that is compiled for the feature, so this
/// asks CPUID itself. It must come before anything that the compiler may have vectorised, and makes
/// do with plain integers and code of the standard library, which runs on every x86-64.
#[inline(never)]
pub(crate) fn is_known() -> bool {
    #[cfg(all(target_arch = "x86_64", target_feature = "avx2"))]
    {
        use std::arch::x86_64::__cpuid_count;
        let leaf = |leaf| {
            if __cpuid_count(leaf & 0x8000_0000, 0).eax < leaf {
                None
            } else {
                Some(__cpuid_count(leaf, 0))
            }
        };
        let [basic, further, extended] = [
            leaf(1).map_or(0, |l| l.ecx),
            leaf(7).map_or(0, |l| l.ebx),
            leaf(0x8000_0001).map_or(0, |l| l.ecx),
        ];
        is_v3(basic, further, extended)
    }
    #[cfg(not(all(target_arch = "x86_64", target_feature = "avx2")))]
    true
}

/// Whether CPUID's leaves 1 (ECX), 7 (EBX) and 8000 0001h (ECX) have all of level x86-64-v3 (System
/// V psABI, table 3.1).
#[cfg(any(test, all(target_arch = "x86_64", target_feature = "avx2")))]
fn is_v3(basic: u32, further: u32, extended: u32) -> bool {
    const FMA: u32 = 1 << 12;
    const MOVBE: u32 = 1 << 22;
    /// The system keeps the wide registers, too.
    const OSXSAVE: u32 = 1 << 27;
    const AVX: u32 = 1 << 28;
    const F16C: u32 = 1 << 29;
    const BMI1: u32 = 1 << 3;
    const AVX2: u32 = 1 << 5;
    const BMI2: u32 = 1 << 8;
    const LZCNT: u32 = 1 << 5;
    let has = |register: u32, bits: u32| register & bits == bits;
    has(basic, FMA | MOVBE | OSXSAVE | AVX | F16C)
        && has(further, BMI1 | AVX2 | BMI2)
        && has(extended, LZCNT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Registers as the processors give them (leaf 1 ECX, leaf 7 EBX, leaf 8000 0001h ECX).
    #[test]
    fn processors_are_told_apart() {
        let haswell = [0x7ffe_fbbf, 0x0000_27ab, 0x0000_0021];
        let ivy_bridge = [0x7fba_e3ff, 0x0000_0281, 0x0000_0001];
        let nehalem = [0x009c_e3bd, 0, 0x0000_0001];
        let is = |[a, b, c]: [u32; 3]| is_v3(a, b, c);
        assert_eq!([is(haswell), is(ivy_bridge), is(nehalem)], [true, false, false]);
        for bit in [12, 22, 27, 28, 29] {
            assert!(!is_v3(haswell[0] & !(1 << bit), haswell[1], haswell[2]), "{bit}");
        }
    }
}
