//! The ramp filter and its windows.

use std::sync::Arc;

use realfft::{ComplexToReal, FftError, RealFftPlanner, RealToComplex, num_complex::Complex};

/// What multiplies the ramp, as a function of frequency over the Nyquist frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Window {
    /// 1 (Ramachandran and Lakshminarayanan): sharpest, noisiest.
    #[default]
    Ramp,
    /// sinc.
    SheppLogan,
    /// Cosine.
    Cosine,
    /// Raised cosine: smoothest.
    Hann,
}

impl Window {
    fn at(self, x: f64) -> f64 {
        let quarter = std::f64::consts::FRAC_PI_2 * x;
        match self {
            Self::Ramp => 1.0,
            Self::SheppLogan if x == 0.0 => 1.0,
            Self::SheppLogan => quarter.sin() / quarter,
            Self::Cosine => quarter.cos(),
            Self::Hann => quarter.cos().powi(2),
        }
    }
}

/// Filters lines of bins and resamples them `fine` times as densely, by one Fourier transform there
/// and one back.
///
/// The ramp is that of the band-limited kernel h(0) = 1/4, h(n odd) = −1/(πn)², h(n even) = 0 (Kak
/// and Slaney 1988, eq. 3.61), padded with zeros to at least twice the line, so that neither the
/// mean is lost nor does anything wrap around.
pub(super) struct Filter {
    to: Arc<dyn RealToComplex<f32>>,
    from: Arc<dyn ComplexToReal<f32>>,
    response: Vec<f32>,
    length: usize,
}

/// Working memory of a [`Filter`].
pub(super) struct Scratch {
    line: Vec<f32>,
    spectrum: Vec<Complex<f32>>,
    pub(super) fine: Vec<f32>,
    work: Vec<Complex<f32>>,
}

impl Filter {
    /// For lines of `bins` bins of width `pitch`; `shape(n)` multiplies the kernel at n bins.
    pub(super) fn new(
        bins: usize,
        pitch: f64,
        window: Window,
        fine: usize,
        shape: impl Fn(f64) -> f64,
    ) -> Self {
        let length = (2 * bins).next_power_of_two().max(16);
        let mut kernel: Vec<f64> = (0..length)
            .map(|i| if i < length / 2 { i as f64 } else { i as f64 - length as f64 })
            .collect();
        for n in &mut kernel {
            *n = match *n {
                0.0 => 0.25,
                n if n % 2.0 == 0.0 => 0.0,
                n => -shape(n) / (std::f64::consts::PI * n).powi(2),
            };
        }
        let mut exact = RealFftPlanner::<f64>::new();
        let mut spectrum = vec![Complex::default(); length / 2 + 1];
        // The lengths fit by construction.
        let _ = exact.plan_fft_forward(length).process(&mut kernel, &mut spectrum);
        let nyquist = (length / 2) as f64;
        let scale = 1.0 / (pitch * length as f64);
        let mut response: Vec<f32> = spectrum
            .iter()
            .enumerate()
            .map(|(i, c)| (c.re * window.at(i as f64 / nyquist) * scale) as f32)
            .collect();
        if fine > 1
            && let Some(last) = response.last_mut()
        {
            *last *= 0.5;
        }
        let mut planner = RealFftPlanner::<f32>::new();
        Self {
            to: planner.plan_fft_forward(length),
            from: planner.plan_fft_inverse(length * fine),
            response,
            length,
        }
    }

    pub(super) fn scratch(&self) -> Scratch {
        let work = self.to.get_scratch_len().max(self.from.get_scratch_len());
        Scratch {
            line: self.to.make_input_vec(),
            spectrum: self.from.make_input_vec(),
            fine: self.from.make_output_vec(),
            work: vec![Complex::default(); work],
        }
    }

    /// Leaves in `scratch.fine` the filtered line, bin `i` at place `i · fine`, all times `weight`.
    pub(super) fn apply(
        &self,
        line: impl IntoIterator<Item = f32>,
        weight: f32,
        scratch: &mut Scratch,
    ) -> Result<(), FftError> {
        let mut line = line.into_iter();
        scratch.line.fill_with(|| line.next().unwrap_or(0.0));
        let (used, unused) = scratch.spectrum.split_at_mut(self.length / 2 + 1);
        self.to.process_with_scratch(
            &mut scratch.line,
            used,
            &mut scratch.work[..self.to.get_scratch_len()],
        )?;
        for (c, r) in used.iter_mut().zip(&self.response) {
            *c *= *r * weight;
        }
        unused.fill(Complex::default());
        if let Some(first) = used.first_mut() {
            first.im = 0.0;
        }
        if let Some(last) = used.last_mut() {
            last.im = 0.0;
        }
        self.from.process_with_scratch(
            &mut scratch.spectrum,
            &mut scratch.fine,
            &mut scratch.work[..self.from.get_scratch_len()],
        )
    }
}
