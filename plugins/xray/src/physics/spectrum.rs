//! What leaves the tube.

use intrados_assets::xray::TUBE;

use super::{Material, PhysicsError, table::rows};

/// Spectra of the bare tube by voltage.
#[derive(Debug, Clone, PartialEq)]
pub struct Tubes {
    kv: Vec<f64>,
    /// Middle of each bin of 1 keV.
    energies: Vec<f64>,
    /// By voltage, then bin.
    fluence: Vec<Vec<f64>>,
}

/// Photons by energy: bins of equal width and constant density, together 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Lower end of the first bin, keV.
    low: f64,
    /// Width of the bins, keV.
    width: f64,
    /// Share of each bin.
    share: Vec<f64>,
    /// Sum of the shares up to the upper end of each bin.
    sum: Vec<f64>,
}

impl Tubes {
    /// The table that the program carries.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if it is damaged.
    pub fn builtin() -> Result<Self, PhysicsError> {
        Self::parse(TUBE)
    }

    fn parse(text: &str) -> Result<Self, PhysicsError> {
        let header = text.lines().next().unwrap_or_default();
        let wrong = |line, problem: &str| PhysicsError::Table {
            file: "tube.csv",
            line,
            problem: problem.into(),
        };
        let kv: Vec<f64> = header.split(',').skip(1).filter_map(|v| v.parse().ok()).collect();
        if kv.len() < 2 || !kv.is_sorted_by(|a, b| a < b) {
            return Err(wrong(1, "voltages must increase"));
        }
        let (mut energies, mut fluence) = (Vec::new(), vec![Vec::new(); kv.len()]);
        for (i, row) in rows("tube.csv", text, kv.len() + 1)?.iter().enumerate() {
            let energy: f64 = row.name.parse().map_err(|_| row.wrong("no energy"))?;
            let values = row.all()?;
            let expected = energies.first().map_or(energy, |first| first + i as f64);
            if values.len() != kv.len() || energy != expected || values.iter().any(|&v| v < 0.0) {
                return Err(
                    row.wrong("energies must go on by 1 keV, fluences be positive, one a voltage")
                );
            }
            energies.push(energy);
            fluence.iter_mut().zip(values).for_each(|(column, v)| column.push(v));
        }
        if energies.is_empty() {
            Err(wrong(1, "no rows"))
        } else {
            Ok(Self { kv, energies, fluence })
        }
    }

    /// The bare tube's spectrum at `kv`, photons per keV·cm²·mAs at 1 m in bins of 1 keV. Between
    /// voltages f/(kV − E) is interpolated, which is constant by Kramers' law.
    ///
    /// # Errors
    /// [`PhysicsError::Voltage`] outside the table.
    pub fn bare(&self, kv: f64) -> Result<Vec<(f64, f64)>, PhysicsError> {
        let (low, high) = (self.kv[0], self.kv[self.kv.len() - 1]);
        if !(low..=high).contains(&kv) {
            return Err(PhysicsError::Voltage { kv, low, high });
        }
        let i = self.kv.partition_point(|&v| v <= kv).clamp(1, self.kv.len() - 1);
        let t = (kv - self.kv[i - 1]) / (self.kv[i] - self.kv[i - 1]);
        let reduced = |column: usize, bin: usize| {
            let room = self.kv[column] - self.energies[bin];
            if room > 0.0 { self.fluence[column][bin] / room } else { f64::NAN }
        };
        let at = |bin: usize| {
            let (a, b) = (reduced(i - 1, bin), reduced(i, bin));
            let value = if a.is_nan() || t == 1.0 {
                b
            } else if b.is_nan() || t == 0.0 {
                a
            } else {
                a + t * (b - a)
            };
            (value * (kv - self.energies[bin])).max(0.0)
        };
        let below = |bin: &usize| self.energies[*bin] < kv;
        Ok((0..self.energies.len())
            .filter(below)
            .map(|bin| (self.energies[bin], at(bin)))
            .collect())
    }

    /// The spectrum behind filters, each of a material and so many metres thick.
    ///
    /// # Errors
    /// [`PhysicsError::Voltage`], [`PhysicsError::EmptySpectrum`] if nothing comes through.
    pub fn filtered(
        &self,
        kv: f64,
        filters: &[(&Material, f64)],
    ) -> Result<Spectrum, PhysicsError> {
        let through = |e: f64| {
            filters.iter().map(|(m, d)| m.density * d * m.attenuation(e).total()).sum::<f64>()
        };
        Spectrum::new(
            &self
                .bare(kv)?
                .into_iter()
                .map(|(e, f)| (e, f * (-through(e)).exp()))
                .collect::<Vec<_>>(),
        )
    }
}

impl Spectrum {
    /// From the middles of bins of equal width and any positive measure of photons in them.
    ///
    /// # Errors
    /// [`PhysicsError::EmptySpectrum`] where nothing is left.
    pub fn new(bins: &[(f64, f64)]) -> Result<Self, PhysicsError> {
        let width = if bins.len() > 1 { bins[1].0 - bins[0].0 } else { 1.0 };
        let all: f64 = bins.iter().map(|b| b.1).sum();
        if !(all > 0.0 && all.is_finite() && width > 0.0) {
            return Err(PhysicsError::EmptySpectrum);
        }
        // Bins that hold next to nothing would only cost time.
        let first = bins.iter().position(|b| b.1 > 1e-12 * all).unwrap_or(0);
        let share: Vec<f64> = bins[first..].iter().map(|b| b.1 / all).collect();
        let sum =
            share.iter().scan(0.0, |sum, s| Some(std::mem::replace(sum, *sum + s) + s)).collect();
        Ok(Self { low: bins[first].0 - 0.5 * width, width, share, sum })
    }

    /// The highest energy, keV.
    #[must_use]
    pub fn top(&self) -> f64 {
        self.low + self.width * self.share.len() as f64
    }

    /// Density at `kev`, per keV.
    #[inline]
    #[must_use]
    pub fn density(&self, kev: f64) -> f64 {
        let at = (kev - self.low) / self.width;
        if at < 0.0 { 0.0 } else { self.share.get(at as usize).map_or(0.0, |s| s / self.width) }
    }

    /// An energy by inversion.
    #[must_use]
    pub fn sample(&self, u: f64) -> f64 {
        let wanted = u * self.sum[self.sum.len() - 1];
        let bin = self.sum.partition_point(|&s| s <= wanted).min(self.share.len() - 1);
        let below = self.sum[bin] - self.share[bin];
        self.low
            + self.width
                * (bin as f64 + ((wanted - below) / self.share[bin]).clamp(0.0, 1.0 - 1e-12))
    }

    /// Share of the photons below `kev`.
    #[must_use]
    pub fn below(&self, kev: f64) -> f64 {
        let at = ((kev - self.low) / self.width).max(0.0);
        let bin = at as usize;
        match self.share.get(bin) {
            Some(share) => {
                (self.sum[bin] - share * (1.0 - at.fract())).max(0.0) / self.sum[self.sum.len() - 1]
            }
            None => 1.0,
        }
    }

    /// Middle and share of every bin.
    pub fn bins(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.share.iter().enumerate().map(|(i, &s)| (self.low + self.width * (i as f64 + 0.5), s))
    }

    /// Mean energy, keV.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.bins().map(|(e, s)| e * s).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::Library;
    use intrados_stage::random::Key;

    /// 225 kV from 200 and 250 kV alone, behind 1 mm of copper, against its own table.
    #[test]
    fn voltages_in_between_are_interpolated() {
        let (tubes, library) = (Tubes::builtin().unwrap(), Library::builtin().unwrap());
        let mut thinned = tubes.clone();
        let at = thinned.kv.iter().position(|kv| *kv == 225.0).unwrap();
        thinned.kv.remove(at);
        thinned.fluence.remove(at);
        let filter = [(library.material("copper").unwrap(), 1e-3)];
        let [own, between] = [&tubes, &thinned].map(|t| t.filtered(225.0, &filter).unwrap());
        let distance: f64 =
            0.5 * own.bins().map(|(e, s)| (between.density(e) - s).abs()).sum::<f64>();
        assert!(distance > 0.0 && distance < 6e-3, "{distance}");
        assert!(
            (between.mean() / own.mean() - 1.0).abs() < 4e-3,
            "{} {}",
            own.mean(),
            between.mean()
        );
    }

    #[test]
    fn samples_follow_the_shares() {
        let spectrum = Spectrum::new(&[(10.0, 1.0), (12.0, 0.0), (14.0, 3.0)]).unwrap();
        let n = 100_000;
        let mut counts = [0_u64; 3];
        for i in 0..n {
            let e = spectrum.sample(Key::new(1, i).unit64(0));
            assert!(spectrum.density(e) > 0.0);
            counts[((e - 9.0) / 2.0) as usize] += 1;
        }
        for e in [9.5, 11.0, 12.0, 13.5] {
            assert!(
                (spectrum.sample(spectrum.below(e) + 1e-12) - e).abs() < 1e-6
                    || spectrum.density(e) == 0.0
            );
        }
        // 0.25 ± 0.0014, four standard deviations.
        assert!((counts[0] as f64 / n as f64 - 0.25).abs() < 0.006 && counts[1] == 0, "{counts:?}");
        assert_eq!(
            (spectrum.top(), spectrum.density(15.1), spectrum.density(8.9)),
            (15.0, 0.0, 0.0)
        );
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let tubes = Tubes::builtin().unwrap();
        assert!(
            matches!(tubes.bare(20.0), Err(PhysicsError::Voltage { .. }))
                && tubes.bare(f64::NAN).is_err()
        );
        let library = Library::builtin().unwrap();
        assert_eq!(
            tubes.filtered(100.0, &[(library.material("tin").unwrap(), 1.0)]),
            Err(PhysicsError::EmptySpectrum)
        );
        assert!(
            Tubes::parse("energy_keV,60,80\n5.5,1,2\n7.5,1,2\n")
                .unwrap_err()
                .to_string()
                .contains("line 3")
        );
        assert!(Tubes::parse("energy_keV,60,80\n5.5,1\n").is_err() && Tubes::parse("").is_err());
    }

    /// Ignored, since nothing can be said without them:
    /// `INTRADOS_DATA=… cargo test --release --workspace -- --ignored with_data`.
    mod with_data {
        use super::*;

        /// Seven spectra of SpekPy, whose filters go by tables other than ours. Distance: half the
        /// sum of the absolute differences of the shares; mean energy.
        #[test]
        #[ignore = "needs INTRADOS_DATA"]
        fn spectra_agree_with_spekpy() {
            let folder = std::env::var_os("INTRADOS_DATA")
                .expect("INTRADOS_DATA must name the folder of test data");
            let text =
                std::fs::read_to_string(std::path::Path::new(&folder).join("spectra.csv")).unwrap();
            let (tubes, library) = (Tubes::builtin().unwrap(), Library::builtin().unwrap());
            let filters = |text: &str| -> Vec<(&str, f64)> {
                let part = |s: &str| {
                    let mut it = s.split(", ");
                    let name = match it.next().unwrap() {
                        "'Al'" => "aluminium",
                        "'Cu'" => "copper",
                        _ => "tin",
                    };
                    (name, it.next().unwrap().parse::<f64>().unwrap())
                };
                text.trim_matches(['[', ']'])
                    .trim_matches(['(', ')'])
                    .split("), (")
                    .map(part)
                    .collect()
            };
            let mut cases: Vec<(String, String, Vec<(f64, f64)>)> = Vec::new();
            for line in text.lines().skip(1) {
                let mut rest = line.rsplit(',');
                let (f, e, _) = (rest.next().unwrap(), rest.next().unwrap(), rest.next().unwrap());
                let (kv, filter) = line.split_once(',').unwrap();
                let filter = filter.trim_start_matches('"').split(']').next().unwrap().to_owned();
                if cases.last().is_none_or(|c| c.0 != kv || c.1 != filter) {
                    cases.push((kv.to_owned(), filter.clone(), Vec::new()));
                }
                cases.last_mut().unwrap().2.push((e.parse().unwrap(), f.parse().unwrap()));
            }
            assert_eq!(cases.len(), 7);
            for (kv, filter, theirs) in cases {
                let named = filters(&filter);
                let of: Vec<(&Material, f64)> =
                    named.iter().map(|(n, mm)| (library.material(n).unwrap(), 1e-3 * mm)).collect();
                let ours = tubes.filtered(kv.parse().unwrap(), &of).unwrap();
                let distance: f64 =
                    0.5 * theirs.iter().map(|(e, f)| (ours.density(*e) - f).abs()).sum::<f64>();
                let mean: f64 = theirs.iter().map(|(e, f)| e * f).sum();
                println!(
                    "{kv} kV {filter}: distance {distance:.2e}, mean {:.2} / {mean:.2} keV",
                    ours.mean()
                );
                assert!(
                    distance < 2.5e-3 && (ours.mean() / mean - 1.0).abs() < 2.5e-3,
                    "{kv} {filter}: {distance} {} {mean}",
                    ours.mean()
                );
            }
        }
    }
}
