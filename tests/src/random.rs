//! Numbers by chance that are the same every time.

/// SplitMix64 (Steele, Lea, Flood 2014), as a number from 0 to 1.
pub fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Near enough to a normal distribution of standard deviation 1: twelve even ones.
pub fn normal(state: &mut u64) -> f64 {
    (0..12).map(|_| random(state)).sum::<f64>() - 6.0
}

/// The seeds from FIRST to LAST of the environment's `SEEDS=FIRST..LAST`, or of `usual`.
pub fn seeds(usual: &str) -> impl Iterator<Item = u64> + Clone + use<> {
    let given = std::env::var("SEEDS").unwrap_or_else(|_| usual.into());
    let (first, last) = given.split_once("..").expect("SEEDS=FIRST..LAST");
    let number = |text: &str| text.parse::<u64>().expect("SEEDS=FIRST..LAST");
    number(first)..=number(last)
}
